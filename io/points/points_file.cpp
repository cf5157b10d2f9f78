// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/points_file.h"

#include <cmath>
#include <cstring>
#include <iterator>

#include "io/lower_case.h"
#include "io/opened_file.h"
#include "io/points/points_document.h"

namespace tetwarp {

namespace {

struct Form {
  const char* suffix;
  std::unique_ptr<PointsDocument> (*parse)(std::string bytes, const std::string& name);
};

constexpr Form kForms[] = {{".csv", parse_csv_points}, {".fcsv", parse_fcsv_points}, {".mrk.json", parse_markups},
                           {".stl", parse_stl_points}, {".obj", parse_obj_points},   {".vtk", parse_vtk_points}};

const Form* form_of(const std::filesystem::path& path) {
  const std::string name = lower(path.filename().string());
  for (const Form& form : kForms) {
    if (name.size() > std::strlen(form.suffix) && name.ends_with(form.suffix)) return &form;
  }
  return nullptr;
}

std::string read_whole(const std::filesystem::path& path) {
  std::ifstream file = opened(path);
  std::string bytes(std::istreambuf_iterator<char>(file), {});
  require(!file.bad(), "cannot be read to its end, " + path.string());
  require(!bytes.empty(), "an empty file, " + path.string());
  return bytes;
}

}  // namespace

std::string points_suffix(const std::filesystem::path& path) {
  const Form* form = form_of(path);
  return form ? form->suffix : "";
}

PointsFile::PointsFile(const std::filesystem::path& path, std::optional<PointFrame> told) {
  const std::string name = path.string();
  const Form* form = form_of(path);
  require(form,
          "unknown suffix of a file of points, " + name + "; expected .csv, .mrk.json, .fcsv, .stl, .obj or .vtk");
  document_ = form->parse(read_whole(path), name);
  require(!document_->points.empty(), "no points, " + name);
  const auto& stated = document_->frame;
  require(!stated || !told || *stated == *told, "the file says " + to_string(stated.value_or(PointFrame::lps)) +
                                                    ", the command line " + to_string(told.value_or(PointFrame::lps)) +
                                                    ", " + name + "; leave the frame out");
  require(stated || told || document_->unsaid != Unsaid::refused,
          "does not say its coordinate system, " + name + "; add :ras or :lps after the output's name");
  frame_ = stated.value_or(told.value_or(PointFrame::lps));
  if (!stated && !told && document_->unsaid == Unsaid::lps_with_note)
    notes_.push_back(name + " does not say its frame: taken as LPS");
  notes_.insert(notes_.end(), document_->notes.begin(), document_->notes.end());
  points_ = document_->points;
  if (frame_ == PointFrame::ras) {
    for (glm::dvec3& point : points_) point = turned(point);
  }
}

PointsFile::~PointsFile() = default;
PointsFile::PointsFile(PointsFile&&) noexcept = default;
PointsFile& PointsFile::operator=(PointsFile&&) noexcept = default;

void PointsFile::write(const std::filesystem::path& path, std::span<const glm::dvec3> points,
                       std::span<const PointStatus> status) const {
  require(points.size() == points_.size() && status.size() == points_.size(),
          std::to_string(points.size()) + " points for a file of " + std::to_string(points_.size()));
  std::vector<glm::dvec3> own(points.begin(), points.end());
  if (frame_ == PointFrame::ras) {
    for (glm::dvec3& point : own) point = turned(point);
  }
  const std::string bytes = document_->rewritten(own, status);
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw Error("cannot be written whole, " + path.string() + "; is the disk full?");
}

}  // namespace tetwarp
