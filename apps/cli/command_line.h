// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// A long option of a subcommand.
struct OptionKind {
  std::string name;   ///< without its dashes
  bool flag = false;  ///< takes no value
  bool list = false;  ///< may be repeated
};

/// Those of `deform`.
std::vector<OptionKind> deform_options();

/// The arguments of `tetwarp deform`, INPUT first. @throws UsageError as for the command line
DeformOptions parse_deform(const std::vector<std::string>& arguments);

}  // namespace tetwarp::apps
