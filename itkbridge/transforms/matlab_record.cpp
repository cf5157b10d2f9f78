// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transforms/matlab_record.h"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>

#include "deform/errors.h"

namespace tetwarp {
namespace {

constexpr std::size_t kHeaderBytes = 20;
constexpr std::uint32_t kLongestName = 200;  // bytes, with the zero at its end

/// A number of a file, in either byte order.
template <class T>
T number(std::string_view bytes, bool big_endian) {
  std::array<char, sizeof(T)> raw{};
  std::copy_n(bytes.begin(), sizeof(T), raw.begin());
  if (big_endian != (std::endian::native == std::endian::big)) std::ranges::reverse(raw);
  return std::bit_cast<T>(raw);
}

/// The header of a matrix: five integers, of which the first, MOPT, says by its decimal digits: M the byte order, O
/// nothing (vnl writes 1 for rows one after the other), P the type of number, T what kind of matrix it is.
struct MatrixHeader {
  bool known = false, big_endian = false, is_float = false;
  std::uint32_t rows = 0, columns = 0, name_bytes = 0;
};

MatrixHeader header_of(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return {};
  for (const bool big_endian : {false, true}) {
    std::array<std::uint32_t, 5> field{};
    for (std::size_t n = 0; n < field.size(); ++n) field[n] = number<std::uint32_t>(bytes.substr(4 * n), big_endian);
    const std::uint32_t order = field[0] / 1000, layout = field[0] / 100 % 10, type = field[0] / 10 % 10;
    if (order != (big_endian ? 1U : 0U) || layout > 1 || type > 1 || field[0] % 10 != 0) continue;
    if (field[3] != 0 || field[4] < 2 || field[4] > kLongestName) continue;
    return {true, big_endian, type == 1, field[1], field[2], field[4]};
  }
  return {};
}

/// A vector with its name.
struct Vector {
  std::string name;
  std::vector<double> values;
};

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path)
      : file_(path.string()), stream_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {}

  bool at_end() const { return at_ == size_; }

  Vector next() {
    const std::uint64_t begin = at_;
    const MatrixHeader header = header_of(take(std::min<std::uint64_t>(kHeaderBytes, size_ - at_)));
    require(header.known, "no vector of MATLAB level 4 at byte " + std::to_string(begin) + " of " + file_ +
                              "; the file may be damaged");
    Vector vector;
    vector.name = take(header.name_bytes);
    vector.name.resize(std::min(vector.name.find('\0'), vector.name.size()));
    const std::uint64_t count = std::uint64_t{header.rows} * header.columns;
    const std::size_t size = header.is_float ? sizeof(float) : sizeof(double);
    require(count <= (size_ - at_) / size, "truncated values of " + vector.name.substr(0, 60) + ", " + file_);
    const std::string values = take(count * size);
    vector.values.resize(count);
    for (std::size_t n = 0; n < count; ++n) {
      const std::string_view one = std::string_view(values).substr(n * size);
      vector.values[n] = header.is_float ? static_cast<double>(number<float>(one, header.big_endian))
                                         : number<double>(one, header.big_endian);
    }
    return vector;
  }

 private:
  std::string take(std::uint64_t count) {
    require(count <= size_ - at_, "truncated, " + file_ + "; is the file whole?");
    std::string bytes(count, '\0');
    stream_.read(bytes.data(), static_cast<std::streamsize>(count));
    require(stream_.good(), "cannot be read whole, " + file_);
    at_ += count;
    return bytes;
  }

  std::string file_;
  std::ifstream stream_;
  std::uint64_t size_, at_ = 0;
};

}  // namespace

bool is_matlab_record(std::string_view first_bytes) { return header_of(first_bytes).known; }

std::vector<TransformRecord> read_matlab_records(const std::filesystem::path& path) {
  const std::string file = path.string();
  Reader reader(path);
  std::vector<TransformRecord> records;
  while (!reader.at_end()) {
    Vector parameters = reader.next();
    require(!reader.at_end(), "no fixed parameters of " + parameters.name.substr(0, 60) + ", " + file);
    Vector fixed = reader.next();
    require(fixed.name == "fixed",
            "\"" + fixed.name.substr(0, 60) + "\" where the vector \"fixed\" is expected, " + file);
    records.push_back({std::move(parameters.name), std::move(fixed.values), std::move(parameters.values)});
  }
  return records;
}

}  // namespace tetwarp
