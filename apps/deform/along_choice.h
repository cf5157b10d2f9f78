// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// A volume that goes along with INPUT: IN=OUT of a --with, and what follows OUT.
struct AlongVolumeChoice {
  InputOptions input;
  std::filesystem::path output;
  std::optional<Interpolation> interpolation;  ///< none: that of INPUT; of a segmentation see usual_interpolation
  std::optional<double> background;            ///< none: as for INPUT; of a DICOM object 0
  bool own = false;                            ///< onto its own grid instead of the output's
  bool segmentation = false;                   ///< a DICOM SEG
};

/// An RT Structure Set that goes along with INPUT: IN.dcm=OUT.dcm of a --with.
struct AlongStructuresChoice {
  std::string text;  ///< as it was given
  std::filesystem::path input, output;
};

using AlongChoice = std::variant<AlongVolumeChoice, AlongStructuresChoice>;

/// Looks into a DICOM file, for what it is. @param frame  which place of a NIfTI file counts
/// @throws UsageError for a volume's text that is not IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]
AlongChoice parse_along(const std::string& text, NiftiFrame frame);
/// Those of one kind, in their order.
template <class Choice>
std::vector<Choice> along_of(const std::vector<AlongChoice>& all) {
  std::vector<Choice> some;
  for (const AlongChoice& one : all)
    if (const auto* choice = std::get_if<Choice>(&one)) some.push_back(*choice);
  return some;
}

/// Whether an output of --with is a DICOM object: ".dcm".
bool is_object_output(const std::filesystem::path& output);

/// @param series  whether OUTPUT is a DICOM series, to which objects can refer
/// @throws UsageError for what cannot be written as its output is named
void check_along(const AlongVolumeChoice& volume, bool series);
void check_along(const AlongStructuresChoice& structures, bool series);

}  // namespace tetwarp::apps
