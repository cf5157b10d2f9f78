// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/med_file.h"

#include <cmath>
#include <utility>

#include "deform/errors.h"
#include "itkbridge/isolated/hdf5_limits.h"
#include "itkbridge/isolated/isolated_read.h"

namespace tetwarp {
namespace {

/// The records of a part of a file (med_reader.h).
std::vector<ReadRecord> read(const std::filesystem::path& path, std::uint64_t part) {
  return read_isolated("mesh-med", path, part, hdf5_limits(path), "HDF5");
}

/// A number of a record's head. The program that answered read a file that may be damaged, so it is not believed.
/// @throws InputError where there is none, or no whole number of a usual size
std::int64_t whole(const ReadRecord& record, std::size_t n, const std::string& file) {
  constexpr double kMost = 1e15;
  require(n < record.head.size() && std::abs(record.head[n]) <= kMost && std::trunc(record.head[n]) == record.head[n],
          [&] { return "no usual number beside \"" + record.name.substr(0, 60) + "\", " + file; });
  return static_cast<std::int64_t>(record.head[n]);
}

}  // namespace

void tetwarp_read_med(const std::filesystem::path& path, MedFile& file) {
  const std::string name = path.string();
  std::vector<ReadRecord> records = read(path, 0);
  constexpr std::size_t kFirst = 2;  // record of cells
  require(records.size() >= kFirst && records[0].values.size() % 3 == 0, "HDF5 cannot read " + name);
  const std::int64_t cells = whole(records[0], 3, name);
  require(cells >= 0 && static_cast<std::uint64_t>(cells) <= records.size() - kFirst, "HDF5 cannot read " + name);
  for (std::size_t n = 0; n < file.version.size(); ++n) file.version[n] = whole(records[0], n, name);
  file.mesh = std::move(records[0].name);
  file.coordinates = std::move(records[0].values);
  file.unit = std::move(records[1].name);
  file.numbers = std::move(records[1].values);
  for (std::size_t n = kFirst; n < records.size(); ++n) {
    ReadRecord& record = records[n];
    if (n < kFirst + static_cast<std::size_t>(cells)) {
      const std::int64_t count = whole(record, 0, name);
      require(count >= 0, [&] { return std::to_string(count) + " cells " + record.name + ", " + name; });
      file.cells.push_back({std::move(record.name), static_cast<std::uint64_t>(count), std::move(record.values)});
      continue;
    }
    const std::int64_t step = whole(record, 0, name), iteration = whole(record, 1, name);
    const auto components = static_cast<std::uint64_t>(whole(record, 2, name));
    file.fields.push_back({std::move(record.name), step, iteration, components});
  }
}

void tetwarp_read_med_vectors(const std::filesystem::path& path, std::uint64_t field,
                              std::vector<MedVectors>& vectors) {
  std::vector<ReadRecord> records = read(path, field + 1);
  require(records.size() % 2 == 0, "HDF5 cannot read " + path.string());
  for (std::size_t n = 0; n < records.size(); n += 2) {
    require(records[n + 1].values.size() % 3 == 0, "HDF5 cannot read " + path.string());
    vectors.push_back({std::move(records[n].values), std::move(records[n + 1].values)});
  }
}

}  // namespace tetwarp
