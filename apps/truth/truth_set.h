// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace tetwarp::apps {

/// One case of a set of known truth. All files lie in the folder of the set.
struct TruthCase {
  std::string name;             ///< of its folder
  std::filesystem::path fixed,  ///< deformed volume
      field,                    ///< forward field: the truth
      body,                     ///< mask of the body of the fixed volume
      labels,                   ///< labels of the fixed volume; empty: none
      landmarks,                ///< where those of the moving volume come to lie; empty: none
      dose,                     ///< dose that went along; empty: none
      bands,         ///< voxels by their distance from a slip, the nearest (1) scored by themselves; or empty
      moving_bands;  ///< the same of the moving volume
  std::vector<double> bands_mm = {};  ///< how far the bands reach
};

/// A set of known truth: what `truth` writes and `score` reads.
struct TruthSet {
  std::filesystem::path folder;
  std::filesystem::path moving,                    ///< the moving volume
      body,                                        ///< mask of its body
      labels, landmarks, dose;                     ///< of the moving volume; empty: none
  std::map<std::int64_t, std::string> roles = {};  ///< what labels are, where a role says it
  std::vector<TruthCase> cases;
};

/// Name of the file that says what a set holds. It is written last: a folder without it is no complete set.
inline constexpr const char* kSetRecord = "set.json";

/// What is written to `kSetRecord`: paths relative to the folder.
nlohmann::json to_json(const TruthSet& set);
/// @throws InputError for a folder without a complete set, or a record that is damaged
TruthSet read_truth_set(const std::filesystem::path& folder);

}  // namespace tetwarp::apps
