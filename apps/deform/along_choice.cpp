// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/along_choice.h"

#include <algorithm>
#include <cmath>

#include "apps/deform/map_outputs.h"
#include "deform/text/text_number.h"
#include "io/dicom_segmentation.h"
#include "io/dicom_structures.h"

namespace tetwarp::apps {

namespace {

constexpr char kForm[] = "expected IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]";

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == at) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::optional<double> number(std::string_view text) {
  const auto value = number_from<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Reads one option that follows OUT. @return whether it is one
bool read_option(std::string_view text, AlongVolumeChoice& options) {
  constexpr std::string_view kBackground = "background=";
  const auto is_first = [](bool given, const char* what) {
    if (given) throw UsageError(std::string("--with has two of ") + what + "; " + kForm);
  };
  if (text == "own") {
    options.own = true;
  } else if (text.starts_with(kBackground)) {
    is_first(options.background.has_value(), "background=");
    options.background = number(text.substr(kBackground.size()));
    return options.background.has_value();
  } else {
    is_first(options.interpolation.has_value(), "nearest, linear, cubic and vote");
    options.interpolation = interpolation_named(text);
    return options.interpolation.has_value();
  }
  return true;
}

AlongVolumeChoice parse_volume(const std::string& text, NiftiFrame frame) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos) throw UsageError("--with \"" + text + "\" names no output; " + kForm);
  AlongVolumeChoice options;
  options.input = volume_named(text.substr(0, equals), frame);
  const std::vector<std::string> parts = split(text.substr(equals + 1), ':');
  options.output = parts.front();
  for (auto part = parts.begin() + 1; part != parts.end(); ++part) {
    if (!read_option(*part, options)) {
      throw UsageError("unknown option \"" + *part + "\" of --with \"" + text + "\"; " + kForm);
    }
  }
  if (options.output.empty()) throw UsageError("--with \"" + text + "\" names no output; " + kForm);
  if (!is_object_output(options.output)) require_image_suffix(options.output, "an output of --with");
  return options;
}

}  // namespace

AlongChoice parse_along(const std::string& text, NiftiFrame frame) {
  const std::filesystem::path input = text.substr(0, text.find('='));
  if (is_dicom_structure_set(input))
    return AlongStructuresChoice{text, input, text.substr(std::min(text.find('='), text.size() - 1) + 1)};
  AlongVolumeChoice volume = parse_volume(text, frame);
  volume.segmentation = is_dicom_segmentation(input);
  return volume;
}

bool is_object_output(const std::filesystem::path& output) { return output.extension() == ".dcm"; }

void check_along(const AlongVolumeChoice& volume, bool series) {
  if (series || !is_object_output(volume.output)) return;
  throw UsageError("a DICOM object refers to a DICOM series, " + volume.output.string() +
                   "; name a folder as OUTPUT, or .nii.gz, .nii, .nrrd or .mha here");
}

void check_along(const AlongStructuresChoice& structures, bool series) {
  if (structures.output.extension() != ".dcm") {
    throw UsageError("--with \"" + structures.text +
                     "\" is an RT Structure Set, which is written as one; expected IN.dcm=OUT.dcm");
  }
  if (series) return;
  throw UsageError(
      "--with \"" + structures.text +
      "\" is an RT Structure Set, whose contours lie on slices of a DICOM series; name a folder as OUTPUT");
}

}  // namespace tetwarp::apps
