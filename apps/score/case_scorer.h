// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/cli/options.h"
#include "apps/score/score_report.h"
#include "apps/truth/truth_set.h"
#include "backend/factories.h"
#include "io/field_file.h"

namespace tetwarp::apps {

/// Scores the results of a set of known truth.
class CaseScorer {
 public:
  /// @param options  outlive this object
  /// @throws InputError for a set whose moving volume or labels cannot be read
  CaseScorer(const ScoreOptions& options, TruthSet set);

  /// Scores the result of a case. What is wrong with it is told in `CaseScore::failure`.
  /// @param results  folder or file of --results, with options of the files
  /// @param back     folder of --back, the same; null: none
  CaseScore score(const FieldSource& results, const FieldSource* back, const TruthCase& one,
                  const std::vector<ScoreLimit>& limits) const;

 private:
  struct Side;  // the volume whose voxels are compared
  /// A volume and its labels; of none the labels hold no data.
  struct Volumes {
    std::shared_ptr<const AnyVolume> ct, labels;
  };

  static Volumes read_volumes(const std::filesystem::path& ct, const std::filesystem::path& labels);

  Side side_of(const TruthCase& one) const;
  PullField read_result(const FieldSource& file, const Geometry& grid, bool forward, std::vector<std::string>& notes,
                        const Control& control) const;
  /// A result at every voxel of a grid.
  PullField sampled(PullField field, const Geometry& grid, const Control& control) const;
  /// @param file  the result among `results`
  void score_field(const FieldSource& results, const FieldSource& file, const FieldSource* back, const TruthCase& one,
                   CaseScore& score) const;
  void score_landmarks(const TruthCase& one, const Side& side, const PullField& result, CaseScore& score) const;
  void score_points(const TruthCase& one, CaseScore& score) const;
  void score_labels(const Side& side, const PullField& result, CaseScore& score, const Control& control) const;
  void score_dose(const TruthCase& one, const PullField& result, CaseScore& score, const Control& control) const;
  void score_back(const FieldSource& back, const TruthCase& one, const Side& side, const PullField& result,
                  CaseScore& score, const Control& control) const;
  void score_triples(const FieldSource& results, const TruthCase& one, const Side& side, const PullField& result,
                     CaseScore& score, const Control& control) const;
  /// A volume of the moving side as a result makes it, on a grid.
  AnyVolume warped(const AnyVolume& volume, const PullField& by, const Geometry& grid, Interpolation interpolation,
                   const Control& control) const;
  Limits limits() const { return {.threads = options_.common.threads}; }

  const ScoreOptions& options_;
  TruthSet set_;
  BackendKind backend_;
  Volumes moving_;
};

}  // namespace tetwarp::apps
