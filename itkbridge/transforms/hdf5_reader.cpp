// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transforms/hdf5_reader.h"

#include <itk_H5Cpp.h>

#include <fstream>

#include "deform/errors.h"
#include "itkbridge/isolated/hdf5_list.h"

namespace tetwarp {
namespace {

constexpr hsize_t kMostTransforms = 1000;
constexpr std::size_t kLongestText = 1000;

class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::filesystem::path& path) : source_(path), hdf5_(path.string(), H5F_ACC_RDONLY) {}

  std::vector<ReadRecord> read() const {
    require(hdf5_.nameExists("/TransformGroup"), "no /TransformGroup in " + file_ + "; expected ITK's transforms");
    const hsize_t count = hdf5_.openGroup("/TransformGroup").getNumObjs();
    require(count <= kMostTransforms, std::to_string(count) + " transforms in " + file_ + "; expected at most " +
                                          std::to_string(kMostTransforms));
    std::vector<ReadRecord> records;
    for (hsize_t n = 0; n < count; ++n) {
      const std::string group = "/TransformGroup/" + std::to_string(n);
      ReadRecord record{text(group + "/TransformType"), {}, {}};
      if (!record.name.starts_with("CompositeTransform")) {
        record.head = values(group, "FixedParameters");
        record.values = values(group, "Parameters");
      }
      records.push_back(std::move(record));
    }
    return records;
  }

 private:
  std::string text(const std::string& name) const {
    const H5::DataSet set = hdf5_.openDataSet(name);
    require(set.getTypeClass() == H5T_STRING && set.getSpace().getSimpleExtentNpoints() == 1,
            name + " is not one string, " + file_);
    if (set.getStrType().isVariableStr()) return heap_text(set, name);
    const std::size_t length = set.getStrType().getSize();
    require(length <= kLongestText, name + " has " + std::to_string(length) + " characters, " + file_ +
                                        "; expected at most " + std::to_string(kLongestText));
    std::string value;
    set.read(value, set.getStrType());
    return value.substr(0, value.find('\0'));
  }

  /// A string of variable length, read from the file's global heap (HDF5 file format specification, III.E) without
  /// HDF5: version 1.10.8 reads outside its memory where the heap is damaged.
  std::string heap_text(const H5::DataSet& set, const std::string& name) const {
    const std::string damaged = name + " is damaged, " + file_;
    require(set.getStorageSize() == 16, damaged);
    std::ifstream stream(file_, std::ios::binary);
    const auto number = [&](std::uint64_t at, int bytes) {  // little endian
      require(static_cast<double>(at) + bytes <= source_.bytes, damaged);
      unsigned char raw[8] = {};
      stream.seekg(static_cast<std::streamoff>(at));
      stream.read(reinterpret_cast<char*>(raw), bytes);
      std::uint64_t value = 0;
      for (int n = bytes; n-- > 0;) value = value << 8 | raw[n];
      return value;
    };
    const std::uint64_t place = set.getOffset(), length = number(place, 4), heap = number(place + 4, 8),
                        wanted = number(place + 12, 4);
    require(length <= kLongestText && number(heap, 4) == 0x4c4f4347, damaged);  // "GCOL", with which a heap begins
    const std::uint64_t end = heap + number(heap + 8, 8);
    for (std::uint64_t at = heap + 16; at + 16 + length <= end;) {
      const std::uint64_t index = number(at, 2), size = number(at + 8, 8);
      if (index == wanted) {
        require(size >= length && static_cast<double>(at + 16 + length) <= source_.bytes, damaged);
        std::string value(length, '\0');
        stream.seekg(static_cast<std::streamoff>(at + 16));
        stream.read(value.data(), static_cast<std::streamsize>(length));
        return value.substr(0, value.find('\0'));
      }
      require(index != 0 && size < end - at, damaged);  // 0 is the index of the free part of the heap
      at += 16 + (size + 7) / 8 * 8;
    }
    throw InputError(damaged);
  }

  std::vector<double> values(const std::string& group, const std::string& what) const {
    std::string name = group + "/Transform" + what;
    if (!hdf5_.nameExists(name)) name = group + "/Tranform" + what;  // ITK 4 and 5 misspell the name like this
    return hdf5_list(hdf5_.openDataSet(name), Hdf5Numbers::real, name, source_);
  }

  Hdf5Source source_;
  const std::string& file_ = source_.file;
  H5::H5File hdf5_;
};

}  // namespace

std::vector<ReadRecord> read_hdf5_unconfined(const std::filesystem::path& path, std::uint64_t) {
  try {
    H5::Exception::dontPrint();
    return Hdf5Reader(path).read();
  } catch (const H5::Exception& error) {
    throw InputError("HDF5 cannot read " + path.string() + ": " + error.getDetailMsg() +
                     "; the file may be truncated or damaged");
  }
}

}  // namespace tetwarp
