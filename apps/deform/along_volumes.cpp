// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/along_volumes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/deform/map_outputs.h"
#include "io/image_file.h"

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
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// Reads one option that follows OUT. @return whether it is one
bool read_option(std::string_view text, AlongOptions& options) {
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

}  // namespace

AlongOptions parse_along(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos) throw UsageError("--with \"" + text + "\" names no output; " + kForm);
  AlongOptions options;
  options.input.path = text.substr(0, equals);
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

AlongVolumes::AlongVolumes(const std::vector<std::string>& texts, bool series, NiftiFrame frame, OutputSet& outputs) {
  for (const std::string& text : texts) {
    One& one = volumes_.emplace_back();
    one.options = parse_along(text);
    one.options.input.nifti_frame = frame;
    if (!series && is_object_output(one.options.output)) {
      throw UsageError("a DICOM object refers to a DICOM series, " + one.options.output.string() +
                       "; name a folder as OUTPUT, or .nii.gz, .nii, .nrrd or .mha here");
    }
    one.staged = outputs.add(one.options.output);
  }
}

void AlongVolumes::open(const InputHeader& input) {
  for (One& one : volumes_) {
    const std::filesystem::path& path = one.options.input.path;
    refuse_pipes(path);
    if (is_dicom_segmentation(path)) {
      one.segmentation = open_segmentation(one.options, input);
      one.header = {one.segmentation->geometry, VoxelType::u8, {}, false, 1};
    } else {
      one.header = open_input(one.options.input, {.stop = interrupt_token()}, true);
      notes_.insert(notes_.end(), one.header.notes.begin(), one.header.notes.end());
    }
    one.own_grid = one.segmentation ? own_grid(*one.segmentation, input.geometry) : straightened(one.header.geometry);
    if (one.options.background && !fits(one.header.type, *one.options.background)) {
      throw UsageError("background=" + nlohmann::json(*one.options.background).dump() + " does not fit the voxels, " +
                       to_string(one.header.type) + ", " + path.string() + "; choose a value in their range");
    }
    if (!is_object_output(one.options.output)) continue;
    if (!one.segmentation && !one.header.dose) {
      throw UsageError("only an RTDOSE or a SEG can be written as a DICOM object, not " + path.string() +
                       "; name the output .nii.gz, .nii, .nrrd or .mha");
    }
    const std::string frame =
        one.segmentation ? one.segmentation->frame_of_reference_uid : read_dose_header(path).frame_of_reference_uid;
    if (const auto note = compare_frames(path, frame, input)) notes_.push_back(*note);
  }
}

std::uint64_t AlongVolumes::bytes(std::uint64_t output_voxels) const {
  std::uint64_t bytes = 0;
  for (const One& one : volumes_) {
    const auto voxels = static_cast<std::uint64_t>(voxel_count(one.header.geometry)),
               results = one.options.own ? static_cast<std::uint64_t>(voxel_count(one.own_grid)) : output_voxels;
    const std::uint64_t volumes = one.segmentation ? one.segmentation->segments.size() : 1;
    bytes +=
        size_bytes(one.header.type) * static_cast<std::uint64_t>(one.header.components) * volumes * (voxels + results);
    if (is_object_output(one.options.output) && one.header.dose) bytes += sizeof(std::int32_t) * results;
  }
  return bytes;
}

void AlongVolumes::read(const CommonOptions& common, const Control& control) {
  for (One& one : volumes_) {
    if (one.segmentation) {
      one.sources = read_segments(one.options.input.path, *one.segmentation);
    } else {
      one.input = read_input(one.options.input, one.header, common, control);
      one.sources.push_back(std::move(one.input.volume));
    }
    if (is_object_output(one.options.output)) one.input.background = 0;
    one.sha256 = one.input.is_dicom() ? one.input.dicom->sha256 : hash_file(one.options.input.path);
  }
}

std::vector<Geometry> AlongVolumes::own_grids() const {
  std::vector<Geometry> grids;
  for (const One& one : volumes_) {
    if (one.options.own && std::find(grids.begin(), grids.end(), one.own_grid) == grids.end())
      grids.push_back(one.own_grid);
  }
  return grids;
}

std::vector<Target> AlongVolumes::targets_on(const Geometry& grid, bool own, Interpolation otherwise) {
  std::vector<Target> targets;
  for (One& one : volumes_) {
    if (one.options.own != own || (own && one.own_grid != grid)) continue;
    const Interpolation usual = one.segmentation ? usual_interpolation(*one.segmentation) : otherwise;
    const std::size_t first = targets.size();
    for (const AnyVolume& source : one.sources) one.outputs.emplace_back(grid, source.type(), source.components());
    for (std::size_t n = 0; n < one.sources.size(); ++n) {
      targets.push_back({.source = std::as_const(one.sources[n]).view(),
                         .output = one.outputs[n].view(),
                         .interpolation = one.options.interpolation.value_or(usual),
                         .background = one.options.background.value_or(one.input.background),
                         .padding = one.input.is_dicom() ? one.input.dicom->padding : std::nullopt});
    }
    one.target = targets[first];
  }
  return targets;
}

void AlongVolumes::write_object(One& one, const DerivedOutput& series) {
  const DicomAlong along = along_with(one.options, one.sha256, one.target, series);
  if (!one.segmentation) {
    one.dose_report = write_derived_dose(one.staged, std::as_const(one.outputs.front()).view(), along, series.written);
    return;
  }
  std::vector<ConstVolumeView> segments;
  for (const AnyVolume& output : one.outputs) segments.push_back(output.view());
  one.segmentation_report = write_derived_segmentation(one.staged, segments, *one.segmentation, along, series.written);
  if (one.segmentation_report->empty) {
    notes_.push_back("nothing is left of the segments of " + one.options.input.path.string() + ", " +
                     one.options.output.string() + " has one empty frame");
  }
}

void AlongVolumes::write(const std::optional<int>& compression, const std::string& descrip,
                         const std::optional<DerivedOutput>& series) {
  for (One& one : volumes_) {
    if (is_object_output(one.options.output)) {
      write_object(one, series.value());
      continue;
    }
    write_image(one.staged, std::as_const(one.outputs.front()).view(),
                {.compression = compression.value_or(-1), .metadata = {{"descrip", descrip}}});
  }
}

nlohmann::json AlongVolumes::describe() const {
  nlohmann::json list = nlohmann::json::array();
  for (const One& one : volumes_) {
    list.push_back({{"input", one.options.input.path.string()},
                    {"sha256", one.sha256},
                    {"output", one.options.output.string()},
                    {"grid", one.options.own ? "own" : "output"},
                    {"voxel_type", to_string(one.header.type)},
                    {"interpolation", name_of(one.target.interpolation)},
                    {"background", one.target.background}});
    if (one.dose_report) list.back()["dicom"] = to_json(*one.dose_report);
    if (one.segmentation_report) list.back()["dicom"] = to_json(*one.segmentation_report, *one.segmentation);
  }
  return list;
}

}  // namespace tetwarp::apps
