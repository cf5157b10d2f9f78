// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/score/case_scorer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "apps/cli/input.h"
#include "apps/fields/read_field.h"
#include "apps/score/error_picture.h"
#include "deform/points.h"
#include "io/image_file.h"
#include "io/points_file.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;
using score::Counts;

/// Suffixes of results: those of fields, transforms and points.
constexpr const char* kSuffixes[] = {".mha",  ".mhd", ".nrrd",   ".nhdr", ".nii",  ".nii.gz",  ".h5",
                                     ".hdf5", ".tfm", ".txt",    ".toml", ".mat",  ".lta",     ".mgz",
                                     ".mgh",  ".mif", ".mif.gz", ".npy",  ".npz",  ".vts",     ".vti",
                                     ".vtr",  ".vtk", ".dcm",    ".csv",  ".fcsv", ".mrk.json"};

/// The file in a folder whose name is `name` and a suffix, with the options of the folder; none: there is no such file.
/// @throws InputError for several
std::optional<FieldSource> result_in(const FieldSource& folder, const std::string& name) {
  std::optional<FieldSource> found;
  for (const char* suffix : kSuffixes) {
    const fs::path file = folder.path / (name + suffix);
    if (!fs::exists(file)) continue;
    require(!found, folder.path.string() + " holds several results of " + name + ", " +
                        (found ? found->path.filename().string() : "") + " and " + file.filename().string() +
                        "; keep one");
    found = folder;
    found->path = file;
  }
  return found;
}

/// The result of a case: that in a folder, or a file itself. @throws InputError for several, or a file for many cases
std::optional<FieldSource> result_of(const FieldSource& results, const TruthSet& set, const TruthCase& one) {
  if (fs::is_directory(results.path)) return result_in(results, one.name);
  require(fs::exists(results.path), "the result " + results.path.string() + " is not there");
  require(set.cases.size() == 1, results.path.string() + " is a file, but the set has " +
                                     std::to_string(set.cases.size()) + " cases; give a folder with a result of each");
  return results;
}

AnyVolume read_or_none(const fs::path& path) { return path.empty() ? AnyVolume() : read_image(path); }

/// Which voxels count: those of the body, the nearest to a slip by themselves.
std::vector<Counts> counts_of(const AnyVolume& body, const AnyVolume& bands, const Geometry& grid) {
  const auto mask = body.as<std::uint8_t>();
  const auto voxels = static_cast<std::size_t>(voxel_count(grid));
  require(mask.size() == voxels && (!bands.data() || bands.as<std::uint8_t>().size() == voxels),
          "the mask of the body and the bands near a slip do not lie on the grid of the volume");
  std::vector<Counts> counts(voxels);
  for (std::size_t n = 0; n < voxels; ++n) {
    const bool is_near = bands.data() && bands.as<std::uint8_t>()[n] == 1;
    counts[n] = mask[n] ? (is_near ? Counts::apart : Counts::yes) : Counts::no;
  }
  return counts;
}

}  // namespace

/// Of a registration from fixed to moving this is the fixed volume, of one in the other direction the moving one.
struct CaseScorer::Side {
  Volumes volumes;
  AnyVolume bands;
  std::vector<Counts> counts;
  Geometry other;                       ///< grid of the other volume
  fs::path landmarks, other_landmarks;  ///< of this volume and of the other one

  const Geometry& grid() const { return volumes.ct->geometry(); }
  bool has_labels() const { return volumes.labels->data() != nullptr; }
};

CaseScorer::CaseScorer(const ScoreOptions& options, TruthSet set)
    : options_(options), set_(std::move(set)), backend_(chosen(options.backend)) {
  moving_ = read_volumes(set_.moving, set_.labels);
}

CaseScore CaseScorer::score(const FieldSource& results, const FieldSource* back, const TruthCase& one,
                            const std::vector<ScoreLimit>& limits) const {
  CaseScore score;
  score.result = text_of(results);
  score.name = one.name;
  score.roles = set_.roles;
  const glm::dvec3& sides = moving_.ct->geometry().spacing;
  score.voxel_side_mm = std::max({sides.x, sides.y, sides.z});
  try {
    const auto result = result_of(results, set_, one);
    if (!result) return score;
    score.file = result->path;
    if (!points_suffix(score.file).empty() && score.file.extension() != ".vtk") {
      require(result->options.empty(), score.file.string() + " holds points, which take no options");
      score_points(one, score);
    } else {
      score_field(results, *result, back, one, score);
    }
    score.checks = check(score, limits);
  } catch (const InputError& error) {  // one bad file does not lose what came of the others
    CaseScore failed;
    failed.result = score.result;
    failed.name = score.name;
    failed.failure = error.what();
    return failed;
  }
  return score;
}

CaseScorer::Volumes CaseScorer::read_volumes(const fs::path& ct, const fs::path& labels) {
  return {std::make_shared<const AnyVolume>(read_image(ct)), std::make_shared<const AnyVolume>(read_or_none(labels))};
}

CaseScorer::Side CaseScorer::side_of(const TruthCase& one) const {
  Side side;
  side.volumes = options_.forward ? moving_ : read_volumes(one.fixed, one.labels);
  side.other = options_.forward ? read_image_header(one.fixed).geometry : moving_.ct->geometry();
  side.bands = read_or_none(options_.forward ? one.moving_bands : one.bands);
  side.counts = counts_of(read_image(options_.forward ? set_.body : one.body), side.bands, side.grid());
  side.landmarks = options_.forward ? set_.landmarks : one.landmarks;
  side.other_landmarks = options_.forward ? one.landmarks : set_.landmarks;
  return side;
}

PullField CaseScorer::sampled(PullField field, const Geometry& grid, const Control& control) const {
  if (field.grid == grid) return field;
  PullField on_grid{grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)))};
  const auto resampler = make_pull_resampler(backend_, grid, options_.device, limits());
  resampler->set_field(view(field, Outside::background), control);
  resampler->resample(whole(grid), {}, {.inverse_mm = samples_of(on_grid)}, control);
  return on_grid;
}

/// A result as its file has it: on a grid of its own, or of a transform sampled at every voxel of `grid`.
/// @param grid     that of the volume from which it leads
/// @param forward  whether it leads from the moving volume to a fixed one
PullField CaseScorer::read_result(const FieldSource& file, const Geometry& grid, bool forward,
                                  std::vector<std::string>& notes, const Control& control) const {
  const PullChoice choice = parse_pull_fields({text_of(file)}, options_.common.nifti_frame);
  const int threads = options_.common.threads;
  ReadPullField read =
      forward ? read_forward_map(choice, grid, threads, control) : read_field(choice, grid, threads, control);
  notes.insert(notes.end(), read.origin.notes.begin(), read.origin.notes.end());
  return std::move(read.field);
}

AnyVolume CaseScorer::warped(const AnyVolume& volume, const PullField& by, const Geometry& grid,
                             Interpolation interpolation, const Control& control) const {
  AnyVolume output(grid, volume.type());
  const auto resampler = make_pull_resampler(backend_, grid, options_.device, limits());
  resampler->set_field(view(by, Outside::background), control);
  const Target target{.source = volume.view(), .output = output.view(), .interpolation = interpolation};
  resampler->resample(whole(grid), {&target, 1}, {}, control);
  return output;
}

void CaseScorer::score_points(const TruthCase& one, CaseScore& score) const {
  const fs::path& file = options_.forward ? one.landmarks : set_.landmarks;
  require(!file.empty(), "the set has no landmarks, with which " + score.file.string() + " could be compared");
  const std::vector<glm::dvec3> found = PointsFile(score.file).points(), wanted = PointsFile(file).points();
  require(found.size() == wanted.size(), score.file.string() + " has " + std::to_string(found.size()) +
                                             " points, the set " + std::to_string(wanted.size()) + " landmarks");
  score.landmarks = score::score_points(found, wanted);
}

void CaseScorer::score_landmarks(const TruthCase& one, const Side& side, const PullField& result,
                                 CaseScore& score) const {
  if (side.landmarks.empty() || side.other_landmarks.empty()) return;
  const std::vector<glm::dvec3> places = PointsFile(side.landmarks).points(),
                                true_places = PointsFile(side.other_landmarks).points();
  require(places.size() == true_places.size(), "the landmarks of " + one.name + " are not those of the set");
  const Geometry& grid = side.grid();
  const AffineMap index = index_from_point(grid);
  std::vector<glm::dvec3> found, wanted;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const glm::i64vec3 voxel(glm::floor(index(places[n]) + 0.5));
    if (glm::clamp(voxel, glm::i64vec3(0), grid.size - std::int64_t{1}) != voxel) continue;  // it left the volume
    const std::int64_t at = voxel.x + grid.size.x * (voxel.y + grid.size.y * voxel.z);
    if (side.counts[static_cast<std::size_t>(at)] == Counts::apart) continue;  // samples of a field say nothing there
    found.push_back(places[n] + score::displacement_at(result, places[n]));
    wanted.push_back(true_places[n]);
  }
  score.landmarks = score::score_points(found, wanted);
}

void CaseScorer::score_labels(const Side& side, const PullField& result, CaseScore& score,
                              const Control& control) const {
  if (!side.has_labels()) return;
  const AnyVolume moved = warped(*moving_.labels, result, side.grid(), Interpolation::vote, control);
  const ConstVolumeView is = moved.view(), should = side.volumes.labels->view();
  score.overlaps = score::compare_labels(should, is);
  if (is_sheared(side.grid()) || !side.grid().slices.empty()) {
    score.notes.push_back("distances of surfaces are not measured on a tilted or uneven grid");
  } else {
    score.surfaces = score::surface_distances(should, is, limits(), {.stop = control.stop});
  }
}

void CaseScorer::score_dose(const TruthCase& one, const PullField& result, CaseScore& score,
                            const Control& control) const {
  if (one.dose.empty() || set_.dose.empty()) return;
  const AnyVolume should = read_image(one.dose);
  const AnyVolume is = warped(read_image(set_.dose), result, should.geometry(), Interpolation::linear, control);
  score.gamma = score::gamma_score(should.view(), is.view(), {}, limits(), control);
}

void CaseScorer::score_back(const FieldSource& back, const TruthCase& one, const Side& side, const PullField& result,
                            CaseScore& score, const Control& control) const {
  const auto file = result_of(back, set_, one);
  require(file.has_value(), "there is no result of " + one.name + " in " + back.path.string());
  const PullField onto = read_result(*file, side.other, !options_.forward, score.notes, control);
  score.inverse_consistency = score::consistency(result, onto, nullptr, side.counts, limits(), {.stop = control.stop});
}

void CaseScorer::score_triples(const FieldSource& results, const TruthCase& one, const Side& side,
                               const PullField& result, CaseScore& score, const Control& control) const {
  if (options_.triples.empty()) return;
  const FieldSource triples = parse_field_source(options_.triples);
  for (const TruthCase& other : set_.cases) {
    const auto between = result_in(triples, one.name + "--" + other.name);
    if (!between) continue;
    const auto onwards = result_of(results, set_, other);
    require(onwards.has_value(), between->path.string() + " leads to " + other.name + ", of which there is no result");
    const Geometry fixed = read_image_header(other.fixed).geometry;
    const PullField first =
                        sampled(read_result(*between, side.grid(), false, score.notes, control), side.grid(), control),
                    second = read_result(*onwards, fixed, false, score.notes, control);
    score.transitivity[other.name] =
        score::consistency(first, second, &result, side.counts, limits(), {.stop = control.stop});
  }
}

void CaseScorer::score_field(const FieldSource& results, const FieldSource& file, const FieldSource* back,
                             const TruthCase& one, CaseScore& score) const {
  Stage stage(options_.common, one.name);
  const Control control = stage.control();
  const Side side = side_of(one);
  const Geometry& grid = side.grid();
  const Geometry &moving = moving_.ct->geometry(), &fixed = options_.forward ? side.other : grid;
  const PullField result = sampled(read_result(file, grid, options_.forward, score.notes, control), grid, control);

  const ForwardChoice choice = parse_forward_fields({one.field.string()}, {}, options_.common.nifti_frame);
  const VertexField field = read_field(choice, moving, options_.common.threads, control).field;
  std::unique_ptr<ForwardResampler> resampler;
  std::unique_ptr<PointMover> mover;
  std::unique_ptr<score::Truth> truth;
  if (options_.forward) {
    mover = std::make_unique<PointMover>(fixed, view(field, Outside::background), limits(), control);
    truth = score::exact_forward(*mover, moving, fixed, limits());
  } else {
    resampler = make_forward_resampler(backend_, grid, options_.device, limits());
    resampler->set_field(view(field, Outside::background), {}, control);
    truth = score::exact_inverse(*resampler);
  }

  std::vector<ConstVolumeView> parts;
  if (side.has_labels()) parts.push_back(side.volumes.labels->view());
  if (side.bands.data()) parts.push_back(side.bands.view());
  const score::DenseScore dense = score::score_field(*truth, result, side.counts, parts, limits(), control);
  if (dense.apart.points + dense.apart.missing > 0) score.apart = dense.apart;
  if (side.has_labels()) score.labels = dense.parts.front();
  if (side.bands.data()) {
    double from = one.bands_mm.front();
    for (std::size_t band = 1; band <= one.bands_mm.size(); ++band) {
      const bool is_last = band == one.bands_mm.size();
      const double to = is_last ? INFINITY : one.bands_mm[band];
      const auto found = dense.parts.back().find(is_last ? 0 : static_cast<std::int64_t>(band + 1));
      if (found != dense.parts.back().end()) score.bands.push_back({from, to, found->second});
      from = to;
    }
  }
  score.dense = dense;
  const score::Reading reading = score::suspected_reading(dense);
  if (reading != score::Reading::as_given)
    score.notes.push_back("this looks like " + score::to_string(reading) + ": so read, the mean error is " +
                          number_text(dense.readings[static_cast<std::size_t>(reading)]) + " mm instead of " +
                          number_text(dense.all.mean));
  score_landmarks(one, side, result, score);
  if (!options_.forward) {  // what left the moving volume cannot be carried back to it
    score_labels(side, result, score, control);
    score_dose(one, result, score, control);
  }
  if (back) score_back(*back, one, side, result, score, control);
  score_triples(results, one, side, result, score, control);
  score.picture = error_picture(*truth, result, side.volumes.ct->view(), side.counts, dense.all.worst);
}

}  // namespace tetwarp::apps
