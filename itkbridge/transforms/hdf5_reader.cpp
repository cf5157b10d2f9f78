// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transforms/hdf5_reader.h"

#include <itk_H5Cpp.h>

#include <algorithm>
#include <fstream>

#include "deform/errors.h"

namespace tetwarp {
namespace {

constexpr hsize_t kMostTransforms = 1000;
constexpr std::size_t kLongestText = 1000;

class Hdf5Reader {
 public:
  explicit Hdf5Reader(const std::filesystem::path& path)
      : file_(path.string()),
        bytes_(static_cast<double>(std::filesystem::file_size(path))),
        hdf5_(path.string(), H5F_ACC_RDONLY) {}

  std::vector<TransformRecord> read() const {
    require(hdf5_.nameExists("/TransformGroup"), "no /TransformGroup in " + file_ + "; expected ITK's transforms");
    const hsize_t count = hdf5_.openGroup("/TransformGroup").getNumObjs();
    require(count <= kMostTransforms, std::to_string(count) + " transforms in " + file_ + "; expected at most " +
                                          std::to_string(kMostTransforms));
    std::vector<TransformRecord> records;
    for (hsize_t n = 0; n < count; ++n) {
      const std::string group = "/TransformGroup/" + std::to_string(n);
      TransformRecord record{text(group + "/TransformType"), {}, {}};
      if (!record.type.starts_with("CompositeTransform")) {
        record.fixed = values(group, "FixedParameters");
        record.parameters = values(group, "Parameters");
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
      require(static_cast<double>(at) + bytes <= bytes_, damaged);
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
        require(size >= length && static_cast<double>(at + 16 + length) <= bytes_, damaged);
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

  /// Whether a type is float or double of IEEE 754, which ITK writes. HDF5 can hold floating-point numbers of any
  /// layout and length.
  static bool is_float_or_double(const H5::DataType& type) {
    using Type = H5::PredType;
    return type == Type::IEEE_F64LE || type == Type::IEEE_F32LE || type == Type::IEEE_F64BE || type == Type::IEEE_F32BE;
  }

  /// Number of values in a chunk, for which HDF5 allocates memory however few of them are read; 0: there are no chunks.
  static hsize_t chunk_of(const H5::DataSet& set) {
    const H5::DSetCreatPropList layout = set.getCreatePlist();
    hsize_t chunk = 0;
    if (layout.getLayout() == H5D_CHUNKED) layout.getChunk(1, &chunk);
    return chunk;
  }

  std::vector<double> values(const std::string& group, const std::string& what) const {
    std::string name = group + "/Transform" + what;
    if (!hdf5_.nameExists(name)) name = group + "/Tranform" + what;  // ITK 4 and 5 misspell the name like this
    const H5::DataSet set = hdf5_.openDataSet(name);
    const H5::DataSpace space = set.getSpace();
    require(is_float_or_double(set.getDataType()) && space.isSimple() && space.getSimpleExtentNdims() == 1,
            name + " is not a list of floats or doubles, " + file_);
    hsize_t count = 0;
    space.getSimpleExtentDims(&count);
    const auto stored = static_cast<double>(set.getStorageSize());
    const double needed =
        static_cast<double>(std::max(count, chunk_of(set))) * static_cast<double>(set.getDataType().getSize());
    require(stored <= bytes_ && needed <= stored * static_cast<double>(kDeflateAtMost),
            "truncated, or a header that promises too much, " + file_ + ": " + name + " has " + std::to_string(count) +
                " values");
    std::vector<double> numbers(count);
    if (count > 0) set.read(numbers.data(), H5::PredType::NATIVE_DOUBLE);
    return numbers;
  }

  std::string file_;
  double bytes_;
  H5::H5File hdf5_;
};

}  // namespace

std::vector<TransformRecord> read_hdf5_unconfined(const std::filesystem::path& path) {
  try {
    H5::Exception::dontPrint();
    return Hdf5Reader(path).read();
  } catch (const H5::Exception& error) {
    throw InputError("HDF5 cannot read " + path.string() + ": " + error.getDetailMsg() +
                     "; the file may be truncated or damaged");
  }
}

}  // namespace tetwarp
