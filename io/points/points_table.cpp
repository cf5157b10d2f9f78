// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads landmarks in lines: CSV, and the .fcsv of 3D Slicer
// (https://www.slicer.org/wiki/Modules:Fiducials-Documentation-3.6, vtkMRMLMarkupsFiducialStorageNode).
#include <algorithm>
#include <array>

#include "deform/errors.h"
#include "io/csv_record.h"
#include "io/points/points_document.h"

namespace tetwarp {

namespace {

/// Where in a file a record has its coordinates, and the field that takes its status.
struct RecordSpans {
  std::array<TextSpan, 3> xyz;
  TextSpan status;
};

const char* name_of(PointStatus status) { return status == PointStatus::moved ? "moved" : "outside"; }

/// Which of the columns are x, y, z. @throws InputError unless each of these is there once
std::array<std::size_t, 3> find_xyz(const std::vector<std::string>& columns, const std::string& where) {
  std::array<std::size_t, 3> found{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string wanted(1, "xyz"[axis]);
    const auto count = std::count(columns.begin(), columns.end(), wanted);
    require(count == 1,
            (count == 0 ? "no column " : "more than one column ") + wanted + where + "; expected a header with x,y,z");
    found[axis] = static_cast<std::size_t>(std::find(columns.begin(), columns.end(), wanted) - columns.begin());
  }
  return found;
}

class TableDocument : public PointsDocument {
 protected:
  explicit TableDocument(std::string all) : bytes(std::move(all)) {}

  void take_row(const CsvRecords& record, const std::array<std::size_t, 3>& xyz, std::size_t columns,
                const std::string& name) {
    const std::string where = at_line(record.line, name);
    require(record.fields.size() == columns, std::to_string(record.fields.size()) + " fields" + where + "; expected " +
                                                 std::to_string(columns) + " as in the header");
    glm::dvec3 point;
    RecordSpans row;
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = number_of(unquoted(record.raw(xyz[axis])), where);
      row.xyz[axis] = record.fields[xyz[axis]];
    }
    row.status = {record.end, record.end};
    rows.push_back(row);
    points.push_back(point);
  }

  /// Replaces the coordinates of a row that lie between two bytes of the file.
  void put(Patch& patch, const RecordSpans& row, const glm::dvec3& before, const glm::dvec3& point, std::size_t from,
           std::size_t to) const {
    std::array<int, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return row.xyz[a].begin < row.xyz[b].begin; });
    for (const int axis : order) {
      if (row.xyz[axis].begin < from || row.xyz[axis].begin >= to || point[axis] == before[axis]) continue;
      patch.replace(row.xyz[axis].begin, row.xyz[axis].end, text_of(point[axis]));
    }
  }

  std::string bytes;
  std::vector<RecordSpans> rows;
};

class CsvDocument : public TableDocument {
 public:
  CsvDocument(std::string all, const std::string& name) : TableDocument(std::move(all)) {
    unsaid = Unsaid::lps_by_form;
    const std::size_t begin = bytes.starts_with("\xEF\xBB\xBF") ? 3 : 0;  // length of a byte order mark
    CsvRecords record(bytes, begin, name);
    require(record.next(), "no header, " + name + "; expected x,y,z");
    header_end_ = record.end;
    std::vector<std::string> columns;
    for (std::size_t n = 0; n < record.fields.size(); ++n) columns.push_back(unquoted(record.raw(n)));
    const auto xyz = find_xyz(columns, at_line(record.line, name));
    const auto status = std::find(columns.begin(), columns.end(), "status");
    has_status_ = status != columns.end();
    while (record.next()) {
      if (record.is_blank()) continue;
      take_row(record, xyz, columns.size(), name);
      if (!has_status_) continue;
      const auto column = static_cast<std::size_t>(status - columns.begin());
      const std::string value = unquoted(record.raw(column));
      require(value == "moved" || value == "outside", "a column status of another meaning (\"" + value + "\")" +
                                                          at_line(record.line, name) +
                                                          "; rename it, for the output adds its own");
      rows.back().status = record.fields[column];
    }
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus> status) const override {
    Patch patch(bytes);
    if (!has_status_) patch.replace(header_end_, header_end_, ",status");
    for (std::size_t n = 0; n < rows.size(); ++n) {
      const TextSpan& at = rows[n].status;
      put(patch, rows[n], points[n], moved[n], 0, at.begin);
      patch.replace(at.begin, at.end, (has_status_ ? "" : ",") + std::string(name_of(status[n])));
      put(patch, rows[n], points[n], moved[n], at.end, bytes.size());
    }
    return patch.take();
  }

 private:
  std::size_t header_end_ = 0;
  bool has_status_ = false;
};

class FcsvDocument : public TableDocument {
 public:
  FcsvDocument(std::string all, const std::string& name) : TableDocument(std::move(all)) {
    unsaid = Unsaid::refused;
    std::vector<std::string> columns;
    std::array<std::size_t, 3> xyz{};
    CsvRecords record(bytes, 0, name);
    while (record.next()) {
      if (record.is_blank()) continue;
      if (bytes[record.begin] == '#') {
        take_header(std::string_view(bytes).substr(record.begin, record.end - record.begin), record.line, name,
                    columns);
        if (!columns.empty()) xyz = find_xyz(columns, at_line(record.line, name));
        continue;
      }
      require(!columns.empty(), "no line \"# columns = ...\" ahead of the points" + at_line(record.line, name));
      take_row(record, xyz, columns.size(), name);
      const auto desc = std::find(columns.begin(), columns.end(), "desc");
      if (desc == columns.end()) continue;
      rows.back().status = record.fields[static_cast<std::size_t>(desc - columns.begin())];
      has_description_ = true;
    }
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus> status) const override {
    Patch patch(bytes);
    for (std::size_t n = 0; n < rows.size(); ++n) {
      const TextSpan& at = rows[n].status;
      put(patch, rows[n], points[n], moved[n], 0, at.begin);
      if (has_description_ && status[n] == PointStatus::outside) {
        const std::string text = unquoted(std::string_view(bytes).substr(at.begin, at.end - at.begin));
        patch.replace(at.begin, at.end, quoted(with_outside_text(text)));
      }
      put(patch, rows[n], points[n], moved[n], at.end, bytes.size());
    }
    return patch.take();
  }

 private:
  /// Takes a header line, "# name = value".
  void take_header(std::string_view line, std::size_t number, const std::string& name,
                   std::vector<std::string>& columns) {
    const auto equals = line.find('=');
    if (equals == std::string_view::npos) return;
    const std::string key = unquoted(line.substr(1, equals - 1)), value = unquoted(line.substr(equals + 1));
    if (key == "CoordinateSystem") frame = frame_of(value, "line " + std::to_string(number) + ", " + name);
    if (key != "columns") return;
    columns.clear();
    CsvRecords record(value, 0, name);
    require(record.next(), "no columns" + at_line(number, name));
    for (std::size_t n = 0; n < record.fields.size(); ++n) columns.push_back(unquoted(record.raw(n)));
  }

  bool has_description_ = false;
};

}  // namespace

std::unique_ptr<PointsDocument> parse_csv_points(std::string bytes, const std::string& name) {
  return std::make_unique<CsvDocument>(std::move(bytes), name);
}

std::unique_ptr<PointsDocument> parse_fcsv_points(std::string bytes, const std::string& name) {
  return std::make_unique<FcsvDocument>(std::move(bytes), name);
}

}  // namespace tetwarp
