// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

namespace tetwarp::bench {

/// A filter, or several one behind the other, and the name under which a process is asked to run it.
struct ItkContender {
  std::string method;   ///< "pull", "itk-warp"
  std::string filters;  ///< "WarpImageFilter"
  bool own = false;     ///< of this toolkit
};

/// What ITK's filters and ours are both asked for.
struct ItkTask {
  std::string key;                       ///< of the command line
  std::string question;                  ///< "the inverse field is given"
  std::string unit;                      ///< of errors: HU, voxels; empty: a ratio
  std::vector<ItkContender> contenders;  ///< ours first
};

/// All of them, in the order of the tables.
const std::vector<ItkTask>& itk_tasks();
/// @throws InputError for another key
const ItkTask& itk_task(const std::string& key);

inline constexpr char kPull[] = "pull", kForward[] = "forward", kInvert[] = "invert", kDeterminant[] = "determinant",
                      kTransform[] = "transform", kStream[] = "stream";

}  // namespace tetwarp::bench
