// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_npz.h"

#include <unzip.h>

#include <algorithm>
#include <array>
#include <memory>
#include <sstream>
#include <vector>

#include "deform/errors.h"
#include "io/fields/numpy_array.h"
#include "io/images/image_reader.h"

namespace tetwarp {
namespace {

/// A zip archive, read by minizip.
class Archive {
 public:
  explicit Archive(const std::filesystem::path& path)
      : file_(path.string()), bytes_(std::filesystem::file_size(path)), archive_(unzOpen64(path.c_str()), unzClose) {
    require(archive_ != nullptr, "no zip archive, " + file_ + "; expected .npz as NumPy writes it");
  }

  /// The names of its arrays, without the suffix .npy.
  std::vector<std::string> keys() {
    constexpr std::size_t kMost = 1000;
    std::vector<std::string> keys;
    for (int more = unzGoToFirstFile(archive_.get()); more == UNZ_OK && keys.size() < kMost;
         more = unzGoToNextFile(archive_.get())) {
      std::array<char, 300> name{};
      if (unzGetCurrentFileInfo64(archive_.get(), nullptr, name.data(), name.size() - 1, nullptr, 0, nullptr, 0) !=
          UNZ_OK)
        break;
      const std::string key(name.data());
      if (key.ends_with(".npy")) keys.push_back(key.substr(0, key.size() - 4));
    }
    return keys;
  }

  /// The bytes of an array. @throws InputError for one that is damaged
  std::string array(const std::string& key) {
    const std::string name = "the array \"" + key + "\" of " + file_;
    require(unzLocateFile(archive_.get(), (key + ".npy").c_str(), 1) == UNZ_OK, "no such array: " + name);
    unz_file_info64 info{};
    require(unzGetCurrentFileInfo64(archive_.get(), &info, nullptr, 0, nullptr, 0, nullptr, 0) == UNZ_OK,
            "damaged, " + name);
    // Deflate makes at most 1032 bytes of one, so what promises more is damage, and nothing is allocated for it.
    require(info.compressed_size <= bytes_ && info.uncompressed_size <= 1032 * (info.compressed_size + 64),
            "a length that the file cannot hold, " + name);
    require(unzOpenCurrentFile(archive_.get()) == UNZ_OK, "cannot be unpacked, " + name);
    std::string bytes(info.uncompressed_size, '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
      constexpr std::size_t kAtOnce = std::size_t{1} << 28;  // of bytes, which an int counts
      const auto wanted = static_cast<unsigned>(std::min(kAtOnce, bytes.size() - done));
      const int read = unzReadCurrentFile(archive_.get(), bytes.data() + done, wanted);
      if (read <= 0) break;
      done += static_cast<std::size_t>(read);
    }
    const int closed = unzCloseCurrentFile(archive_.get());  // compares the check sum
    require(done == bytes.size() && closed == UNZ_OK, "truncated or damaged, " + name + "; is the file whole?");
    return bytes;
  }

 private:
  std::string file_;
  std::uint64_t bytes_;
  std::unique_ptr<void, int (*)(void*)> archive_;
};

bool recognizes(const std::filesystem::path& path, std::string_view) { return path.extension() == ".npz"; }

FieldSource without_key(const FieldSource& source) {
  FieldSource others = source;
  others.options.erase("key");
  return others;
}

void check_options(const FieldSource& source) { check_numpy_options(without_key(source), ", key"); }

/// The name of the array to read. @throws InputError where it must be chosen
std::string key_of(const FieldSource& source, Archive& archive) {
  if (source.options.contains("key")) return source.option("key");
  const std::vector<std::string> keys = archive.keys();
  std::string list;
  for (const std::string& key : keys) list += (list.empty() ? "" : ", ") + key;
  require(keys.size() == 1, std::to_string(keys.size()) + " arrays (" + list.substr(0, 200) + "), " +
                                source.path.string() + "; choose one with key=NAME");
  return keys.front();
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  check_options(source);
  require_readable_file(source.path);
  Archive archive(source.path);
  const std::string key = key_of(source, archive);
  const auto bytes = std::make_shared<const std::string>(archive.array(key));
  const auto opened = [bytes]() -> std::unique_ptr<std::istream> {
    return std::make_unique<std::istringstream>(*bytes);
  };
  const NumpyArray array =
      read_numpy_header(*opened(), bytes->size(), "the array \"" + key + "\" of " + source.path.string());
  return numpy_reader(without_key(source), array, "NumPy archive, array \"" + key + "\"", opened);
}

}  // namespace

const FieldFormat kFieldFormat_npz = {recognizes, nullptr, check_options, open};

}  // namespace tetwarp
