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
struct AlongVolumeText {
  InputOptions input;
  std::filesystem::path output;
  std::optional<Interpolation> interpolation;  ///< none: that of INPUT; of a segmentation see usual_interpolation
  std::optional<double> background;            ///< none: as for INPUT; of a DICOM object 0
  bool own = false;                            ///< onto its own grid instead of the output's
  bool segmentation = false;                   ///< a DICOM SEG
};

/// An RT Structure Set that goes along with INPUT: IN.dcm=OUT.dcm of a --with.
struct AlongStructuresText {
  std::string text;  ///< as it was given
  std::filesystem::path input, output;
};

using AlongText = std::variant<AlongVolumeText, AlongStructuresText>;

/// Looks into a DICOM file, for what it is. @param frame  which place of a NIfTI file counts
/// @throws UsageError for a volume's text that is not IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]
AlongText parse_along(const std::string& text, NiftiFrame frame);
/// The texts of one kind, in their order.
template <class Text>
std::vector<Text> along_of(const std::vector<AlongText>& all) {
  std::vector<Text> some;
  for (const AlongText& one : all)
    if (const auto* text = std::get_if<Text>(&one)) some.push_back(*text);
  return some;
}

/// Whether an output of --with is a DICOM object: ".dcm".
bool is_object_output(const std::filesystem::path& output);

/// @param series  whether OUTPUT is a DICOM series, to which objects can refer
/// @throws UsageError for what cannot be written as its output is named
void check_along(const AlongVolumeText& volume, bool series);
void check_along(const AlongStructuresText& structures, bool series);

}  // namespace tetwarp::apps
