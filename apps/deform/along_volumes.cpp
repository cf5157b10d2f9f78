// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/along_volumes.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

/// @throws UsageError, InputError for a DICOM object that cannot be written, or lies in another space than INPUT
/// @return a note, where INPUT does not say in which it lies
std::optional<std::string> check_object(const AlongHeader& one, const InputHeader& input) {
  if (!is_object_output(one.choice.output)) return std::nullopt;
  const std::filesystem::path& path = one.choice.input.path;
  if (!one.segmentation && !one.header.dose) {
    throw UsageError("only an RTDOSE or a SEG can be written as a DICOM object, not " + path.string() +
                     "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  const std::string frame =
      one.segmentation ? one.segmentation->frame_of_reference_uid : read_dose_header(path).frame_of_reference_uid;
  return compare_frames(path, frame, input);
}

AlongHeader open_one(const AlongVolumeChoice& choice, const InputHeader& input) {
  AlongHeader one{choice, {}, {}, {}};
  refuse_pipes(choice.input.path);
  if (choice.segmentation) {
    one.segmentation = open_segmentation(choice, input);
    one.header = {one.segmentation->geometry, VoxelType::u8, {}, false, 1};
  } else {
    one.header = open_input(choice.input, {.stop = interrupt_token()}, true);
  }
  one.own_grid = one.segmentation ? own_grid(*one.segmentation, input.geometry) : straightened(one.header.geometry);
  if (choice.background && !fits(one.header.type, *choice.background)) {
    throw UsageError("background=" + nlohmann::json(*choice.background).dump() + " does not fit the voxels, " +
                     to_string(one.header.type) + ", " + choice.input.path.string() +
                     "; choose a value in their range");
  }
  return one;
}

}  // namespace

AlongHeaders open_along(const std::vector<AlongVolumeChoice>& choices, const InputHeader& input) {
  AlongHeaders opened;
  for (const AlongVolumeChoice& choice : choices) {
    const AlongHeader& one = opened.volumes.emplace_back(open_one(choice, input));
    opened.notes.insert(opened.notes.end(), one.header.notes.begin(), one.header.notes.end());
    if (const auto note = check_object(one, input)) opened.notes.push_back(*note);
  }
  return opened;
}

namespace {

/// Of all values of a volume, or of all segments of a segmentation.
std::uint64_t voxel_bytes(const AlongHeader& one) {
  const std::uint64_t volumes = one.segmentation ? one.segmentation->segments.size() : 1;
  return size_bytes(one.header.type) * static_cast<std::uint64_t>(one.header.components) * volumes;
}

std::uint64_t result_voxels(const AlongHeader& one, std::uint64_t output_voxels) {
  return one.choice.own ? static_cast<std::uint64_t>(voxel_count(one.own_grid)) : output_voxels;
}

}  // namespace

std::uint64_t along_result_bytes(const AlongHeader& header, std::uint64_t output_voxels) {
  return voxel_bytes(header) * result_voxels(header, output_voxels);
}

std::uint64_t along_bytes(const std::vector<AlongHeader>& headers, std::uint64_t output_voxels) {
  std::uint64_t bytes = 0;
  for (const AlongHeader& one : headers) {
    bytes += voxel_bytes(one) * static_cast<std::uint64_t>(voxel_count(one.header.geometry)) +
             along_result_bytes(one, output_voxels);
    if (is_object_output(one.choice.output) && one.header.dose)
      bytes += sizeof(std::int32_t) * result_voxels(one, output_voxels);
  }
  return bytes;
}

std::vector<AlongInput> read_along(const std::vector<AlongHeader>& headers, const CommonOptions& common,
                                   const Control& control) {
  std::vector<AlongInput> inputs;
  for (const AlongHeader& one : headers) {
    AlongInput& input = inputs.emplace_back();
    const std::filesystem::path& path = one.choice.input.path;
    std::optional<DicomVolume> dicom;
    if (one.segmentation) {
      input.sources = read_segments(path, *one.segmentation);
    } else {
      InputVolume read = read_input(one.choice.input, one.header, common, control);
      input.sources.push_back(std::move(read.volume));
      input.background = read.background;
      dicom = std::move(read.dicom);
    }
    if (is_object_output(one.choice.output)) input.background = 0;
    if (dicom) input.padding = dicom->padding;
    input.sha256 = dicom ? dicom->sha256 : hash_file(path);
  }
  return inputs;
}

std::vector<Geometry> own_grids_of(const std::vector<AlongHeader>& headers) {
  std::vector<Geometry> grids;
  for (const AlongHeader& one : headers) {
    if (one.choice.own && std::find(grids.begin(), grids.end(), one.own_grid) == grids.end())
      grids.push_back(one.own_grid);
  }
  return grids;
}

std::vector<AlongResult> make_along_results(const std::vector<AlongHeader>& headers,
                                            const std::vector<AlongInput>& inputs, const Geometry& output,
                                            Interpolation otherwise) {
  std::vector<AlongResult> results;
  for (std::size_t n = 0; n < headers.size(); ++n) {
    const AlongHeader& one = headers[n];
    const Interpolation usual = one.segmentation ? usual_interpolation(*one.segmentation) : otherwise;
    AlongResult& result = results.emplace_back();
    result.interpolation = one.choice.interpolation.value_or(usual);
    result.background = one.choice.background.value_or(inputs[n].background);
    for (const AnyVolume& source : inputs[n].sources)
      result.outputs.emplace_back(one.choice.own ? one.own_grid : output, source.type(), source.components());
  }
  return results;
}

std::vector<Target> along_targets(const std::vector<AlongHeader>& headers, const std::vector<AlongInput>& inputs,
                                  std::vector<AlongResult>& results, const Geometry& grid, bool own) {
  std::vector<Target> targets;
  for (std::size_t n = 0; n < headers.size(); ++n) {
    if (headers[n].choice.own != own || (own && headers[n].own_grid != grid)) continue;
    for (std::size_t part = 0; part < inputs[n].sources.size(); ++part) {
      targets.push_back({.source = inputs[n].sources[part].view(),
                         .output = results[n].outputs[part].view(),
                         .interpolation = results[n].interpolation,
                         .background = results[n].background,
                         .padding = inputs[n].padding});
    }
  }
  return targets;
}

namespace {

AlongWritten write_object(const std::filesystem::path& staged, const AlongHeader& one, const AlongInput& input,
                          const AlongResult& result, const DerivedOutput& series) {
  const DicomAlong along = dicom_along(one.choice, input.sha256, result.interpolation, result.background, series);
  if (!one.segmentation) return {write_derived_dose(staged, result.outputs.front().view(), along, series.written), {}};
  std::vector<ConstVolumeView> segments;
  for (const AnyVolume& output : result.outputs) segments.push_back(output.view());
  return {{}, write_derived_segmentation(staged, segments, *one.segmentation, along, series.written)};
}

}  // namespace

std::vector<AlongWritten> write_along(const std::vector<std::filesystem::path>& staged,
                                      const std::vector<AlongHeader>& headers, const std::vector<AlongInput>& inputs,
                                      const std::vector<AlongResult>& results, const ImageWriteOptions& how,
                                      const std::optional<DerivedOutput>& series) {
  std::vector<AlongWritten> written(headers.size());
  for (std::size_t n = 0; n < headers.size(); ++n) {
    if (is_object_output(headers[n].choice.output))
      written[n] = write_object(staged[n], headers[n], inputs[n], results[n], series.value());
    else
      write_image(staged[n], results[n].outputs.front().view(), how);
  }
  return written;
}

nlohmann::json along_json(const std::vector<AlongHeader>& headers, const std::vector<AlongInput>& inputs,
                          const std::vector<AlongResult>& results, const std::vector<AlongWritten>& written) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t n = 0; n < headers.size(); ++n) {
    const AlongHeader& one = headers[n];
    list.push_back({{"input", one.choice.input.path.string()},
                    {"sha256", inputs[n].sha256},
                    {"output", one.choice.output.string()},
                    {"grid", one.choice.own ? "own" : "output"},
                    {"voxel_type", to_string(one.header.type)},
                    {"interpolation", name_of(results[n].interpolation)},
                    {"background", results[n].background}});
    if (written[n].dose) list.back()["dicom"] = to_json(*written[n].dose);
    if (written[n].segmentation) list.back()["dicom"] = to_json(*written[n].segmentation, *one.segmentation);
  }
  return list;
}

std::vector<std::string> notes_of(const std::vector<AlongHeader>& headers, const std::vector<AlongWritten>& written) {
  std::vector<std::string> notes;
  for (std::size_t n = 0; n < headers.size(); ++n) {
    if (!written[n].segmentation || !written[n].segmentation->empty) continue;
    notes.push_back("nothing is left of the segments of " + headers[n].choice.input.path.string() + ", " +
                    headers[n].choice.output.string() + " has one empty frame");
  }
  return notes;
}

}  // namespace tetwarp::apps
