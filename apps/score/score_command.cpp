// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iostream>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/fields/read_field.h"
#include "apps/score/score_report.h"
#include "apps/truth/truth_set.h"
#include "backend/factories.h"
#include "deform/core/trilinear.h"
#include "deform/points.h"
#include "io/image_file.h"
#include "io/png.h"
#include "io/points_file.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Suffixes of results: those of fields, transforms and points.
constexpr const char* kSuffixes[] = {".mha",  ".mhd", ".nrrd", ".nhdr", ".nii",  ".nii.gz",  ".h5",
                                     ".hdf5", ".tfm", ".txt",  ".toml", ".mat",  ".npy",     ".vts",
                                     ".vti",  ".vtk", ".dcm",  ".csv",  ".fcsv", ".mrk.json"};

/// The file of a case in a folder of results: CASE and a suffix. @throws InputError for several
fs::path result_of(const fs::path& results, const TruthSet& set, const TruthCase& one) {
  if (!fs::is_directory(results)) {
    require(fs::exists(results), "the result " + results.string() + " is not there");
    require(set.cases.size() == 1, results.string() + " is a file, but the set has " +
                                       std::to_string(set.cases.size()) +
                                       " cases; give a folder with a result of each");
    return results;
  }
  fs::path found;
  for (const char* suffix : kSuffixes) {
    const fs::path file = results / (one.name + suffix);
    if (!fs::exists(file)) continue;
    require(found.empty(), results.string() + " holds several results of " + one.name + ", " +
                               found.filename().string() + " and " + file.filename().string() + "; keep one");
    found = file;
  }
  return found;
}

/// T(p) - p at places that need not be voxel centres: trilinear, NaN where a sample is missing.
glm::dvec3 displacement_at(const PullField& field, const AffineMap& index, const glm::dvec3& place) {
  const glm::i64vec3 size = field.grid.size;
  return trilinear(size, index(place), [&](const glm::i64vec3& at) {
    return field.displacement[static_cast<std::size_t>(at.x + size.x * (at.y + size.y * at.z))];
  });
}

/// Scores the results of a set.
class Scorer {
 public:
  Scorer(const ScoreOptions& options, TruthSet set)
      : options_(options), set_(std::move(set)), backend_(chosen(options.backend)) {
    moving_ = read_image(set_.moving);
    if (!set_.labels.empty()) labels_ = read_image(set_.labels);
  }

  CaseScore score(const fs::path& results, const TruthCase& one, const std::vector<ScoreLimit>& limits);

 private:
  void score_field(const TruthCase& one, CaseScore& score);
  void score_landmarks(const std::vector<glm::dvec3>& found, CaseScore& score) const;
  PullField sampled(const PullField& field, const Geometry& grid, const Control& control) const;
  /// The axial slice through a place, with errors in red where voxels count.
  std::vector<std::uint8_t> picture(ForwardResampler& truth, const PullField& result, const ConstVolumeView& fixed,
                                    std::span<const std::uint8_t> counts, const glm::dvec3& worst) const;
  Limits limits() const { return {.threads = options_.common.threads}; }

  const ScoreOptions& options_;
  TruthSet set_;
  BackendKind backend_;
  AnyVolume moving_, labels_;
};

CaseScore Scorer::score(const fs::path& results, const TruthCase& one, const std::vector<ScoreLimit>& limits) {
  CaseScore score;
  score.result = results.string();
  score.name = one.name;
  try {
    score.file = result_of(results, set_, one);
    if (score.file.empty()) return score;
    if (!points_suffix(score.file).empty() && score.file.extension() != ".vtk") {
      require(!one.landmarks.empty(),
              "the set has no landmarks, with which " + score.file.string() + " could be compared");
      score_landmarks(PointsFile(score.file).points(), score);
    } else {
      score_field(one, score);
    }
    score.checks = check(score, limits);
  } catch (const InputError& error) {  // one bad file does not lose what came of the others
    score = {};
    score.result = results.string();
    score.name = one.name;
    score.failure = error.what();
  }
  return score;
}

PullField Scorer::sampled(const PullField& field, const Geometry& grid, const Control& control) const {
  if (field.grid == grid) return field;
  PullField on_grid{grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)))};
  const auto resampler = make_pull_resampler(backend_, grid, options_.device, limits());
  resampler->set_field(view(field, Outside::background), control);
  resampler->resample(whole(grid), {}, {.inverse_mm = samples_of(on_grid)}, control);
  return on_grid;
}

void Scorer::score_landmarks(const std::vector<glm::dvec3>& found, CaseScore& score) const {
  const std::vector<glm::dvec3> wanted = PointsFile(set_.landmarks).points();
  require(found.size() == wanted.size(), score.file.string() + " has " + std::to_string(found.size()) +
                                             " points, the set " + std::to_string(wanted.size()) + " landmarks");
  score.landmarks = score::score_points(found, wanted);
}

void Scorer::score_field(const TruthCase& one, CaseScore& score) {
  Stage stage(options_.common, one.name);
  const AnyVolume fixed = read_image(one.fixed), body = read_image(one.body);
  const Geometry& grid = fixed.geometry();
  AnyVolume fixed_labels;
  if (!one.labels.empty()) fixed_labels = read_image(one.labels);

  const ReadPullField read = read_field(parse_pull_field(score.file.string(), options_.common.nifti_frame),
                                        moving_.geometry(), grid, options_.common.threads, stage.control());
  score.notes = read.origin.notes;
  const PullField result = sampled(read.field, grid, stage.control());
  const ForwardChoice choice = parse_forward_fields({one.field.string()}, {}, options_.common.nifti_frame);
  const VertexField field = read_field(choice, moving_.geometry(), options_.common.threads, stage.control()).field;
  const auto truth = make_forward_resampler(backend_, grid, options_.device, limits());
  truth->set_field(view(field, Outside::background), {}, stage.control());

  const auto mask = body.as<std::uint8_t>();
  const ConstVolumeView labels = one.labels.empty() ? ConstVolumeView{} : std::as_const(fixed_labels).view();
  std::vector<std::uint8_t> counts(mask.begin(), mask.end()), near(counts.size());
  if (!one.apart.empty()) {
    const AnyVolume marked = read_image(one.apart);
    const auto apart = marked.as<std::uint8_t>();
    require(apart.size() == counts.size(), one.apart.string() + " has another size than " + one.fixed.string());
    for (std::size_t n = 0; n < counts.size(); ++n) {
      near[n] = counts[n] && apart[n];
      counts[n] = counts[n] && !apart[n];
    }
    if (std::find(near.begin(), near.end(), 1) != near.end())
      score.apart = score::score_field(*truth, result, near, {}, limits(), stage.control()).all;
  }
  score.dense = score::score_field(*truth, result, counts, labels, limits(), stage.control());
  const score::Reading reading = score::suspected_reading(*score.dense);
  if (reading != score::Reading::as_given)
    score.notes.push_back("this looks like " + score::to_string(reading) + ": so read, the mean error is " +
                          number_text(score.dense->readings[static_cast<std::size_t>(reading)]) + " mm instead of " +
                          number_text(score.dense->all.mean));
  if (!one.landmarks.empty()) {
    const std::vector<glm::dvec3> fixed_places = PointsFile(one.landmarks).points(),
                                  moving_places = PointsFile(set_.landmarks).points();
    require(fixed_places.size() == moving_places.size(), "the landmarks of " + one.name + " are not those of the set");
    const AffineMap index = index_from_point(grid);
    std::vector<glm::dvec3> found, wanted;
    for (std::size_t n = 0; n < fixed_places.size(); ++n) {
      const glm::i64vec3 voxel(glm::floor(index(fixed_places[n]) + 0.5));
      if (glm::clamp(voxel, glm::i64vec3(0), grid.size - std::int64_t{1}) != voxel)
        continue;  // it left the fixed volume
      const std::int64_t at = voxel.x + grid.size.x * (voxel.y + grid.size.y * voxel.z);
      if (near[static_cast<std::size_t>(at)]) continue;  // samples of a field say nothing there
      found.push_back(fixed_places[n] + displacement_at(result, index, fixed_places[n]));
      wanted.push_back(moving_places[n]);
    }
    score.landmarks = score::score_points(found, wanted);
  }
  if (!one.labels.empty()) {
    AnyVolume warped(grid, labels_.type());
    const auto resampler = make_pull_resampler(backend_, grid, options_.device, limits());
    resampler->set_field(view(result, Outside::background), stage.control());
    const Target target{
        .source = std::as_const(labels_).view(), .output = warped.view(), .interpolation = Interpolation::vote};
    resampler->resample(whole(grid), {&target, 1}, {}, stage.control());
    score.overlaps = score::compare_labels(labels, std::as_const(warped).view());
  }
  score.picture = picture(*truth, result, fixed.view(), counts, score.dense->all.worst);
}

std::vector<std::uint8_t> Scorer::picture(ForwardResampler& truth, const PullField& result,
                                          const ConstVolumeView& fixed, std::span<const std::uint8_t> counts,
                                          const glm::dvec3& worst) const {
  constexpr double kMostMm = 10, kLowHu = -1000, kHighHu = 400;
  const Geometry& grid = truth.output();
  const glm::i64vec3 size = grid.size;
  const auto k =
      std::clamp(static_cast<std::int64_t>(std::lround(index_from_point(grid)(worst).z)), std::int64_t{0}, size.z - 1);
  const Region slice{{0, 0, k}, {size.x, size.y, k + 1}};
  std::vector<glm::vec3> inverse(static_cast<std::size_t>(size.x * size.y));
  truth.resample(slice, {},
                 {.inverse_mm = {&grid, slice, VoxelType::f32, 3, std::as_writable_bytes(std::span(inverse)).data()}});
  const int larger = size.x < 300 ? 2 : 1;
  Picture picture(static_cast<int>(size.x) * larger, static_cast<int>(size.y) * larger);
  dispatch(fixed.type, [&]<class V>(V) {
    const V* values = reinterpret_cast<const V*>(fixed.voxels) + k * size.x * size.y;
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        const auto n = static_cast<std::size_t>(i + size.x * j);
        const double grey = std::clamp((static_cast<double>(values[n]) - kLowHu) / (kHighHu - kLowHu), 0.0, 1.0);
        const std::size_t voxel = n + static_cast<std::size_t>(k * size.x * size.y);
        const glm::vec3 found = result.displacement[voxel];
        double red = grey, green = grey, blue = grey;
        if (counts[voxel] && !std::isnan(inverse[n].x)) {
          if (std::isnan(found.x)) {
            blue = 1;
          } else {
            const double share = std::min(glm::distance(glm::dvec3(found), glm::dvec3(inverse[n])) / kMostMm, 1.0);
            red += share * (1 - red), green *= 1 - share, blue *= 1 - share;
          }
        }
        const auto byte = [](double part) { return static_cast<std::uint8_t>(std::lround(255 * part)); };
        picture.fill(static_cast<int>(i) * larger, static_cast<int>(j) * larger, larger, larger,
                     {byte(red), byte(green), byte(blue)});
      }
    }
  });
  return png_bytes(picture);
}

}  // namespace

int run_score(const ScoreOptions& options) {
  const std::vector<ScoreLimit> limits = read_limits(options.limits);
  const TruthSet set = read_truth_set(options.set);
  Reads reads;
  reads.add_file(options.set / kSetRecord);
  for (const TruthCase& one : set.cases) {
    for (const fs::path& file : {one.fixed, one.field, one.body, one.labels, one.landmarks})
      if (!file.empty()) reads.add_file(file);
  }
  for (const fs::path& results : options.results) {
    require(fs::exists(results), "the results, " + results.string() + ", are not there");
    if (!fs::is_directory(results)) reads.add_file(results);
    for (const fs::path& output : {options.json, options.csv, options.html}) {
      if (!output.empty() && fs::is_directory(results) &&
          fs::weakly_canonical(fs::absolute(output).parent_path()) == fs::canonical(results))
        throw UsageError(output.string() + " would lie among the results; put it elsewhere");
    }
  }
  if (!options.limits.empty()) reads.add_file(options.limits);
  OutputSet outputs(reads, options.common.overwrite);
  const fs::path json_file = outputs.add(options.json), csv = outputs.add(options.csv),
                 html = outputs.add(options.html);
  Scorer scorer(options, set);
  std::vector<CaseScore> scores;
  for (const TruthCase& one : set.cases) {
    for (const fs::path& results : options.results) {
      scores.push_back(scorer.score(results, one, limits));
      std::cout << (options.results.size() > 1 ? results.string() + ", " : "") << line_of(scores.back()) << "\n";
      for (const std::string& note : scores.back().notes)
        say(options.common, "tetwarp: note: " + one.name + ": " + note);
    }
  }
  outputs.write([&] {
    if (!json_file.empty()) {
      json document = provenance("score");
      document["set"] = options.set.string();
      document["scores"] = json::array();
      for (const CaseScore& score : scores) document["scores"].push_back(to_json(score));
      write_json(json_file, Record::open(document));
    }
    if (!csv.empty()) write_text(csv, csv_of(scores));
    if (!html.empty()) write_text(html, page_of(options.set.string(), scores, limits));
  });
  outputs.commit();
  return std::all_of(scores.begin(), scores.end(), [](const CaseScore& score) { return score.passed(); }) ? 0 : 3;
}

}  // namespace tetwarp::apps
