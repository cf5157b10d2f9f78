// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "deform/score/gamma.h"
#include "deform/score/overlap.h"
#include "deform/score/registration_score.h"
#include "deform/score/surface_distance.h"

namespace tetwarp::apps {

/// A bound that a result has to keep.
struct ScoreLimit {
  std::string name;    ///< key of --limits
  std::string about;   ///< what is bounded, with its unit
  double most;         ///< largest value that passes
  std::string source;  ///< who asks for it
  bool is_voxel_side =
      false;  ///< whether instead the largest side of a voxel of the moving volume is the largest value
};
/// Those that count unless a file says otherwise.
std::vector<ScoreLimit> usual_limits();
/// Limits of a file over the usual ones. @param file  empty: the usual ones
/// @throws InputError for a file that cannot be read, or a limit of another name
std::vector<ScoreLimit> read_limits(const std::filesystem::path& file);

/// A limit, applied.
struct ScoreCheck {
  ScoreLimit limit;
  double value = 0;
  bool passed() const { return value <= limit.most; }
};

/// Errors of the voxels at some distance from a slip.
struct BandErrors {
  double from_mm, to_mm;  ///< distance; the last band has no end, and `to_mm` is infinite
  score::Errors errors;
};

/// What came of one result.
struct CaseScore {
  std::string result,          ///< folder or file of --results, as it was given
      name;                    ///< of the case
  std::filesystem::path file;  ///< that was scored; empty: there was none
  std::string failure;         ///< why it could not be scored; empty: it was
  std::vector<std::string> notes;
  std::map<std::int64_t, std::string> roles;     ///< what labels are, as far as the set says it
  double voxel_side_mm = 0;                      ///< largest side of a voxel of the moving volume
  std::optional<score::DenseScore> dense;        ///< of a field
  std::map<std::int64_t, score::Errors> labels;  ///< of the voxels of each label
  std::vector<BandErrors> bands;                 ///< by distance from a slip, beyond what is scored by itself
  std::optional<score::Errors> apart;            ///< of what lies near a slip, and does not count in `dense`
  std::optional<score::Errors> landmarks;        ///< empty: the set has none
  /// Of the labels of the volume whose voxels are compared, and those that the field makes of the other volume's.
  std::map<std::int64_t, score::Overlap> overlaps;
  std::map<std::int64_t, score::Errors> surfaces;     ///< distances of the surfaces of the same labels
  std::optional<score::GammaScore> gamma;             ///< of the dose that goes along
  std::optional<score::Errors> inverse_consistency;   ///< with the result of the other direction
  std::map<std::string, score::Errors> transitivity;  ///< by the case over which the other way leads
  std::vector<ScoreCheck> checks;
  std::vector<std::uint8_t> picture;  ///< PNG: the slice where the error is largest

  bool passed() const;
};

/// Applies limits to what was measured.
std::vector<ScoreCheck> check(const CaseScore& score, const std::vector<ScoreLimit>& limits);

nlohmann::json to_json(const CaseScore& score);
/// A header, and a row for each case and label.
std::string csv_of(const std::vector<CaseScore>& scores);
/// One page of HTML with pictures in it.
std::string page_of(const std::string& set, const std::vector<CaseScore>& scores,
                    const std::vector<ScoreLimit>& limits);
/// Such as "12.4 to 22.4 mm from the slip".
std::string band_name(const BandErrors& band);
/// A label as people read it: "label 2 (lung)".
std::string label_name(const CaseScore& score, std::int64_t label);
/// A line for a person.
std::string line_of(const CaseScore& score);

}  // namespace tetwarp::apps
