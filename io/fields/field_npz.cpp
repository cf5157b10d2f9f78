// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_npz.h"

#include <unzip.h>

#include <algorithm>
#include <array>
#include <istream>
#include <memory>
#include <span>
#include <streambuf>
#include <vector>

#include "deform/errors.h"
#include "io/fields/shared/numpy_array.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"

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

  /// Goes to the first byte of an array. @return how many bytes it has @throws InputError for one that is damaged
  std::uint64_t open_array(const std::string& key) {
    const std::string name = name_of(key);
    require(unzLocateFile(archive_.get(), (key + ".npy").c_str(), 1) == UNZ_OK, "no such array: " + name);
    unz_file_info64 info{};
    require(unzGetCurrentFileInfo64(archive_.get(), &info, nullptr, 0, nullptr, 0, nullptr, 0) == UNZ_OK,
            "damaged, " + name);
    // Deflate makes at most 1032 bytes of one, so what promises more is damage, and nothing is allocated for it.
    require(info.compressed_size <= bytes_ && info.uncompressed_size <= 1032 * (info.compressed_size + 64),
            "a length that the file cannot hold, " + name);
    require(unzOpenCurrentFile(archive_.get()) == UNZ_OK, "cannot be unpacked, " + name);
    return info.uncompressed_size;
  }
  /// Reads on in the array. @return how many bytes were read; 0 at its end and where it is damaged
  std::size_t read(std::span<char> bytes) {
    const int read = unzReadCurrentFile(archive_.get(), bytes.data(), static_cast<unsigned>(bytes.size()));
    return read > 0 ? static_cast<std::size_t>(read) : 0;
  }
  /// Ends the reading of an array. @return whether its check sum is right, if all of it was read
  bool close_array() { return unzCloseCurrentFile(archive_.get()) == UNZ_OK; }

  std::string name_of(const std::string& key) const { return "the array \"" + key + "\" of " + file_; }

 private:
  std::string file_;
  std::uint64_t bytes_;
  std::unique_ptr<void, int (*)(void*)> archive_;
};

/// An array of an archive, unpacked a piece at a time. It ends early where the archive is damaged; the last piece is
/// given only if the check sum is right. It goes back within its first piece alone, which a header of NumPy fits.
class ArrayBuffer final : public std::streambuf {
 public:
  ArrayBuffer(const std::filesystem::path& path, const std::string& key)
      : archive_(path), size_(archive_.open_array(key)) {}

  std::uint64_t size() const { return size_; }

 protected:
  int_type underflow() override {
    std::size_t filled = 0;
    while (filled < piece_.size()) {
      const std::size_t count = archive_.read(std::span(piece_).subspan(filled));
      if (count == 0) break;
      filled += count;
    }
    begin_ = done_;
    done_ += filled;
    const bool last = filled > 0 && done_ == size_;
    if (filled == 0 || (last && !archive_.close_array())) return traits_type::eof();
    setg(piece_.data(), piece_.data(), piece_.data() + filled);
    return traits_type::to_int_type(*gptr());
  }

  pos_type seekpos(pos_type position, std::ios_base::openmode) override {
    const auto at = static_cast<std::uint64_t>(std::streamoff(position));
    if (done_ == 0 && traits_type::eq_int_type(underflow(), traits_type::eof())) return pos_type(off_type(-1));
    if (at < begin_ || at > done_) return pos_type(off_type(-1));
    setg(eback(), eback() + (at - begin_), egptr());
    return position;
  }

 private:
  Archive archive_;
  std::uint64_t size_, begin_ = 0, done_ = 0;  ///< bytes of the array, before the piece, and with it
  std::vector<char> piece_ = std::vector<char>(std::size_t{1} << 16);
};

class ArrayStream final : public std::istream {
 public:
  ArrayStream(const std::filesystem::path& path, const std::string& key) : std::istream(nullptr), buffer_(path, key) {
    rdbuf(&buffer_);
  }
  std::uint64_t size() const { return buffer_.size(); }

 private:
  ArrayBuffer buffer_;
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return lower(path.extension().string()) == ".npz";
}

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
  require(!keys.empty(), "no arrays, " + source.path.string() + "; expected .npz as NumPy writes it");
  require(keys.size() == 1, std::to_string(keys.size()) + " arrays (" + list.substr(0, 200) + "), " +
                                source.path.string() + "; choose one with key=NAME");
  return keys.front();
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  check_options(source);
  require_readable_file(source.path);
  Archive archive(source.path);
  const std::string key = key_of(source, archive);
  const auto opened = [path = source.path, key]() -> std::unique_ptr<std::istream> {
    return std::make_unique<ArrayStream>(path, key);
  };
  ArrayStream stream(source.path, key);
  const NumpyArray array = read_numpy_header(stream, stream.size(), archive.name_of(key));
  return numpy_reader(without_key(source), array, "NumPy archive, array \"" + key + "\"", opened);
}

}  // namespace

const FieldFormat kFieldFormat_npz = {recognizes, nullptr, check_options, open};

}  // namespace tetwarp
