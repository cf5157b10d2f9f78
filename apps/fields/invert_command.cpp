// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstdio>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "apps/cli/input.h"
#include "apps/cli/reads.h"
#include "apps/deform/map_outputs.h"
#include "apps/fields/read_field.h"
#include "deform/fields/continued.h"
#include "io/field_file.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

std::string text_of(const Residuals& residuals) {
  char text[96];
  std::snprintf(text, sizeof text, "mean %.3g, 99 %% below %.3g, largest %.3g mm", residuals.mean,
                residuals.percentile_99, residuals.largest);
  return text;
}

/// The map to invert, from wherever the lattice is to places in the grid of --like.
struct Invertible {
  AnyField field;  ///< forward
  FieldOrigin origin;
  Geometry pull_grid = {};     ///< of a pull field, before it was continued
  std::string pull_text = {};  ///< what a pull field is called

  const VertexField& forward() const { return std::get<VertexField>(field); }
};

Invertible read_invertible(const ForwardChoice& choice, const Geometry& like, int threads, const Control& control) {
  ReadForwardField read = read_field(choice, like, threads, control);
  return {std::move(read.field), std::move(read.origin)};
}

/// A lattice of one cell over the box of some points and the grid `like`, along the axes of that grid.
Geometry cell_over(const Geometry& like, const std::vector<glm::dvec3>& points) {
  const AffineMap index = index_from_point(like);
  glm::dvec3 low(0), high(like.size - std::int64_t{1});
  for (const glm::dvec3& point : points) {
    low = glm::min(low, index(point));
    high = glm::max(high, index(point));
  }
  low -= 1.0;  // what rounding may need
  high += 1.0;
  Geometry cell = like;
  cell.size = glm::i64vec3(2);
  cell.spacing = like.spacing * (high - low);
  cell.origin = point_from_index(like)(low);
  return cell;
}

/// Affine maps as a field of one cell, which reaches wherever the inverse leads. Where all maps are affine that is
/// exact, and nothing has to be continued.
/// @param grid  of the vertices of the inverse
ReadPullField read_affine(const PullChoice& choice, const Geometry& grid, int threads, const Control& control) {
  const Geometry first = cell_over(grid, {});
  const ReadPullField near = read_field(choice, first, threads, control);
  const auto corner = [&](int i, int j, int k) {
    const std::size_t vertex = static_cast<std::size_t>(i + 2 * (j + 2 * k));
    return point_from_index(first)(glm::dvec3(i, j, k)) + glm::dvec3(near.field.displacement[vertex]);
  };
  AffineMap map;
  for (int axis = 0; axis < 3; ++axis) map.linear[axis] = corner(axis == 0, axis == 1, axis == 2) - corner(0, 0, 0);
  map.offset = corner(0, 0, 0);
  const AffineMap index_from_image = inverse_of(map);
  std::vector<glm::dvec3> begin;  // of the points that lead to the corners of the grid
  for (int n = 0; n < 8; ++n) {
    const glm::dvec3 at = glm::dvec3(n & 1, n >> 1 & 1, n >> 2 & 1) * glm::dvec3(grid.size - std::int64_t{1});
    begin.push_back(point_from_index(first)(index_from_image(point_from_index(grid)(at))));
  }
  return read_field(choice, cell_over(grid, begin), threads, control);
}

Invertible read_invertible(const PullChoice& choice, const Geometry& like, int threads, const Control& control) {
  const Geometry grid = straightened(like);  // of the vertices of the inverse, on which a tilted stack is not held
  if (is_affine(choice)) {
    ReadPullField read = read_affine(choice, grid, threads, control);
    const Geometry cell = read.field.grid;
    return {VertexField{cell, std::move(read.field.displacement)}, std::move(read.origin), cell, text_of(choice)};
  }
  ReadPullField read = read_field(choice, grid, threads, control);
  try {
    return {continued_over(read.field, grid), std::move(read.origin), read.field.grid, text_of(choice)};
  } catch (const InputError& error) {
    throw InputError(std::string(error.what()) + ", " + text_of(choice));
  }
}

/// What came out, and what is left after going there and back.
struct Inversion {
  std::string backend;
  Geometry grid;
  Report report;
  std::uint64_t beyond = 0;  ///< vertices whose place lies beyond the grid of the pull field
  Residuals there, back;
  double field_seconds = 0, invert_seconds = 0, check_seconds = 0;
};

/// Counts samples of an inverse whose place lies beyond the grid of the pull field. @param samples  some slices
std::uint64_t count_beyond(const VolumeView& samples, const Geometry& grid) {
  constexpr double kRounding = 1e-3;  // of a sample
  const AffineMap point = point_from_index(*samples.geometry), index = index_from_point(grid);
  const glm::dvec3 last(grid.size - std::int64_t{1});
  const Region& held = samples.buffered;
  const auto* displacement = reinterpret_cast<const glm::vec3*>(samples.voxels);
  std::uint64_t beyond = 0;
  for (std::int64_t k = held.begin.z; k < held.end.z; ++k) {
    for (std::int64_t j = held.begin.y; j < held.end.y; ++j) {
      for (std::int64_t i = held.begin.x; i < held.end.x; ++i, ++displacement) {
        const glm::dvec3 at = index(point(glm::dvec3(i, j, k)) + glm::dvec3(*displacement));
        beyond += glm::clamp(at, glm::dvec3(-kRounding), last + kRounding) != at;
      }
    }
  }
  return beyond;
}

/// Refuses an inverse without a place at some vertex, where a forward field is to be written.
/// @throws InputError where there is none
void check_forward(const InvertOptions& options, const Inversion& result, Invertible& field) {
  require(result.report.uncovered == 0, std::to_string(result.report.uncovered) + " voxels of " +
                                            options.like.path.string() + " have no place by the inverse of " +
                                            field.pull_text + "; a forward field needs one at every vertex");
  if (result.beyond == 0) return;
  field.origin.notes.push_back(std::to_string(result.beyond) + " of " + std::to_string(voxel_count(result.grid)) +
                               " vertices go beyond the grid of " + field.pull_text +
                               ", which goes on there with its outermost samples");
}

json document_of(const InvertOptions& options, const Invertible& field, const Inversion& result) {
  json document = provenance("invert");
  document["backend"] = result.backend;
  document["field"] = {{"sha256", hash_field(field.field, options.common.threads)},
                       {"notes", field.origin.notes},
                       {"files", to_json(field.origin.files)}};
  document["field"].update(place_json(field.field));
  document["output"] = {{"path", options.output.string()},
                        {"direction", options.field.pull.empty() ? "pull" : "forward"},
                        {"geometry", to_json(result.grid)}};
  document["covered"] = result.report.covered;
  document["uncovered"] = result.report.uncovered;
  document["inverted"] = result.report.inverted;
  document["forward_after_inverse"] = to_json(result.there);
  document["inverse_after_forward"] = to_json(result.back);
  document["stages"] = {{"field", {{"seconds", result.field_seconds}}},
                        {"invert", {{"seconds", result.invert_seconds}}},
                        {"check", {{"seconds", result.check_seconds}}}};
  document["memory"] = {{"peak_bytes", peak_memory_bytes()}};
  return document;
}

void say_all(const InvertOptions& options, const Invertible& field, const Inversion& result) {
  for (const std::string& note : field.origin.notes) say(options.common, "tetwarp: note: " + note);
  if (result.report.inverted > 0) {
    say(options.common, "tetwarp: warning: the field folds, " + std::to_string(result.report.inverted) +
                            " tetrahedra are inverted: where several places map to one, the inverse gives one of them");
  }
  const bool forward = !options.field.pull.empty();
  say(options.common,
      "wrote " + options.output.string() + (forward ? ": forward field, " : ": inverse displacement, ") +
          to_string(result.grid.size) +
          (forward ? " vertices" : " samples, " + std::to_string(result.report.uncovered) + " of them empty"));
  say(options.common, "forward after inverse: " + text_of(result.there));
  say(options.common, "inverse after forward: " + text_of(result.back));
}

/// The series that `deform` would derive from --like, of which no slice is written: a registration object is beside it.
class UnwrittenSeries {
 public:
  UnwrittenSeries(const InvertOptions& options, const InputHeader& like, const Invertible& field,
                  const Control& control)
      : headers_(read_input(options.like, like, options.common, control).dicom->headers),
        writer_({}, straightened(like.geometry), *headers_,
                {.field_sha256 = hash_field(field.field, options.common.threads),
                 .parameters = "direction=forward",
                 .description = field.origin.identity ? "The identity, inverted" : "A field of vertices, inverted",
                 .deformed = !field.origin.identity}) {}

  const DerivedSeriesWriter& writer() const { return writer_; }

 private:
  std::shared_ptr<const DicomHeaders> headers_;
  DerivedSeriesWriter writer_;
};

/// Inverts slab by slab into the file. @param series  what a registration object is beside, if the output is one
Inversion invert(const InvertOptions& options, const Geometry& like, Invertible& field,
                 const std::filesystem::path& output, const UnwrittenSeries* series, OutputSet& outputs) {
  const Control stop{.stop = interrupt_token()};
  const bool pulls = !options.field.pull.empty();
  const Limits limits{.threads = options.common.threads};
  const AnyResampler resampler = make_resampler_for(field.field, like, {options.backend, options.device}, limits);
  Inversion result{.backend = name_of(resampler.backend()), .grid = like, .report = {}, .there = {}, .back = {}};
  InverseCheck check(field.forward(), like, limits);
  MapStream stream(like, outputs);
  outputs.write([&] {
    stream.add(&Maps::inverse_mm, series
                                      ? series->writer().create_registration(output)
                                      : create_field_file(output, like, pulls ? Direction::forward : Direction::pull));
  });
  Stage stage(options.common, "invert");
  set_field(resampler, field.field, Outside::background, {.jacobian_range = false}, stop);
  stream.run([&](const Region& slab, const Maps& maps) {
    result.report += resample_slab(*resampler, slab, {}, maps, stage.control());
    const double begun = stage.seconds();
    check.add(maps.inverse_mm, stop);
    if (pulls) result.beyond += count_beyond(maps.inverse_mm, field.pull_grid);
    result.check_seconds += stage.seconds() - begun;
  });
  result.invert_seconds = stage.seconds() - result.check_seconds;
  result.there = check.forward_after_inverse();
  result.back = check.inverse_after_forward();
  if (pulls) check_forward(options, result, field);
  return result;
}

/// @throws UsageError for an output that is no file of a field, or not of this one
void check_output(const InvertOptions& options) {
  if (has_image_suffix(options.output)) return;
  const std::string name = options.output.string();
  if (!has_registration_suffix(options.output)) {
    throw UsageError("unknown suffix of \"" + name +
                     "\"; a displacement field is written as .mha .nrrd .nii .nii.gz, or .dcm");
  }
  if (!options.field.pull.empty()) {
    throw UsageError("the inverse of a pull field is a forward field, which a DICOM registration, " + name +
                     ", cannot hold; name it .mha .nrrd .nii .nii.gz");
  }
  if (has_image_suffix(options.like.path)) {
    throw UsageError("a DICOM registration, " + name + ", needs the frame of reference of a DICOM series, --like is " +
                     options.like.path.string() + "; name the output .mha .nrrd .nii .nii.gz");
  }
}

}  // namespace

int run_invert(const InvertOptions& options) {
  const bool pulls = !options.field.pull.empty();
  check_output(options);
  if (pulls && options.field.cell_size) throw UsageError("--cell-size does not go with --pull-field; leave it out");
  const FieldChoice choice = parse_field(options.field, options.common.nifti_frame);
  const Reads reads = reads_of(choice, options.like);
  OutputSet outputs(reads, options.common.overwrite);
  const std::filesystem::path output = outputs.add(options.output), report_path = outputs.add(options.report);
  const InputHeader like = open_input(options.like, options.common);
  outputs.add_reads(reads.slices(options.like, like));
  const bool registers = has_registration_suffix(options.output);
  if (registers) {
    if (!like.series)
      throw UsageError("a DICOM registration needs a CT series as --like, not " + options.like.path.string());
    require_registration_fits(straightened(like.geometry));
  }

  Stage field_stage(options.common, "field");
  const Geometry grid = straightened(like.geometry);
  const Control control = field_stage.control();
  Invertible field = std::visit(
      [&](const auto& one) { return read_invertible(one, like.geometry, options.common.threads, control); }, choice);
  field.origin.notes.insert(field.origin.notes.begin(), like.notes.begin(), like.notes.end());
  const double field_seconds = field_stage.seconds();
  std::optional<UnwrittenSeries> series;
  if (registers) series.emplace(options, like, field, Control{.stop = interrupt_token()});
  Inversion result = invert(options, grid, field, output, series ? &*series : nullptr, outputs);
  result.field_seconds = field_seconds;
  outputs.write([&] {
    if (!report_path.empty()) write_json(report_path, Record::open(document_of(options, field, result)));
  });
  outputs.commit();
  say_all(options, field, result);
  return 0;
}

}  // namespace tetwarp::apps
