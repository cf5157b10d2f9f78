// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli/input.h"
#include "apps/info/info_command.h"
#include "deform/phantom.h"
#include "io/dicom_series.h"
#include "io/image_file.h"
#include "io/staged_output.h"
#include "python/src/arrays.h"
#include "python/src/calls.h"
#include "python/src/module.h"

namespace tetwarp::python {

namespace {

apps::CommonOptions quiet(int threads, const std::string& nifti_frame) {
  require(nifti_frame == "sform" || nifti_frame == "qform",
          "nifti_frame is \"" + nifti_frame + "\"; expected \"sform\" or \"qform\"");
  apps::CommonOptions common;
  common.quiet = true;
  common.threads = threads_of(threads);
  common.nifti_frame = nifti_frame == "sform" ? NiftiFrame::sform : NiftiFrame::qform;
  return common;
}

/// The headers of a DICOM series, from which a derived one is written.
struct SeriesHeaders {
  std::shared_ptr<const DicomHeaders> headers;
  std::string series_uid, study_uid, frame_of_reference_uid;
};

/// Voxels, grid, background, padding, notes, and headers of a series (or None).
nb::tuple read(const std::filesystem::path& path, const std::string& series, bool single, bool uneven,
               const std::string& nifti_frame, int threads, const CallOptions& options) {
  apps::InputOptions input;
  input.path = path;
  input.series = series;
  input.single = single;
  input.uneven = uneven;
  input.hash = FileHash::left_out;
  const apps::CommonOptions common = quiet(threads, nifti_frame);
  input.nifti_frame = common.nifti_frame;
  apps::InputVolume volume;
  apps::InputHeader header;
  run_call(options, false, [&](const Control& control) {
    header = apps::open_input(input, {.stop = control.stop}, true);
    volume = apps::read_input(input, header, common, control);
  });
  nb::object padding = nb::none(), headers = nb::none();
  std::vector<std::string> notes = header.notes;
  if (volume.dicom) {
    if (volume.dicom->padding) padding = nb::make_tuple(volume.dicom->padding->low, volume.dicom->padding->high);
    headers = nb::cast(SeriesHeaders{volume.dicom->headers, header.series->series_uid, header.series->study_uid,
                                     header.series->frame_of_reference_uid});
    notes.insert(notes.end(), header.series->warnings.begin(), header.series->warnings.end());
    for (const LeftOutFile& one : header.series->set_aside) notes.push_back("left out: " + to_string(one));
  }
  const Geometry grid = volume.volume.geometry();
  return nb::make_tuple(as_numpy(std::move(volume.volume)), grid, volume.background, padding, notes, headers);
}

void write_file(const std::filesystem::path& path, const ConstArray& array, const Geometry& grid, int compression,
                const std::map<std::string, std::string>& metadata, bool overwrite, const CallOptions& options) {
  const ConstVolumeView view = voxels_of(array, grid, "the volume");
  require(view.memory == Memory::host, "the volume lies on a device; copy it to the host to write it");
  run_call(options, voxel_count(grid) < kSmallFile, [&](const Control& control) {
    StagedOutput output(path, StagedOutput::Kind::file, overwrite);
    write_image(output.path(), view, {.compression = compression, .metadata = metadata}, control);
    output.commit();
  });
}

/// @return Study, Series and Frame of Reference UID of what was written
nb::tuple write_series(const std::filesystem::path& folder, const ConstArray& array, const Geometry& grid,
                       const SeriesHeaders& source, const std::map<std::string, std::string>& derivation,
                       double background_hu, bool deformed, bool keep_frame_of_reference,
                       std::optional<int> series_number, std::optional<std::string> series_description, int threads,
                       bool overwrite, const CallOptions& options) {
  const ConstVolumeView view = voxels_of(array, grid, "the volume");
  require(view.memory == Memory::host, "the volume lies on a device; copy it to the host to write it");
  require(view.type == VoxelType::i16 && view.components == 1,
          "the volume holds " + to_string(view.type) + "; a DICOM CT series holds int16 values in HU");
  const auto text = [&](const char* key) {
    const auto found = derivation.find(key);
    return found == derivation.end() ? std::string() : found->second;
  };
  DicomDerivation how{.field_sha256 = text("field_sha256"),
                      .parameters = text("parameters"),
                      .description = text("description"),
                      .deformed = deformed,
                      .background_hu = background_hu};
  how.form.keep_frame_of_reference = keep_frame_of_reference;
  how.form.series_number = series_number;
  how.form.series_description = std::move(series_description);
  DicomWriteReport report;
  run_call(options, false, [&](const Control& control) {
    StagedOutput output(folder, StagedOutput::Kind::folder, overwrite, &is_tetwarp_dicom);
    report = write_derived_series(output.path(), view, *source.headers, how, {}, threads_of(threads), control);
    output.commit();
  });
  return nb::make_tuple(report.study_uid, report.series_uid, report.frame_of_reference_uid);
}

std::string info(const std::filesystem::path& path, bool single, const std::string& nifti_frame) {
  apps::InfoOptions options;
  options.common = quiet(0, nifti_frame);
  options.input.path = path;
  options.input.single = single;
  options.json = true;
  const WithoutGil released;
  return apps::info_document(options).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// The phantom, its grid, and its labels or None.
nb::tuple phantom(const std::array<std::int64_t, 3>& size, const std::array<double, 3>& spacing, std::uint64_t seed,
                  double noise_hu, bool labels, const CallOptions& options) {
  LabelledPhantom made;
  run_call(options, false, [&](const Control&) {
    const glm::i64vec3 voxels(size[0], size[1], size[2]);
    const glm::dvec3 mm(spacing[0], spacing[1], spacing[2]);
    if (labels) {
      made = make_labelled_phantom(voxels, mm, seed, {.noise_hu = noise_hu});
    } else {
      made.ct = make_phantom(voxels, mm, seed, {.noise_hu = noise_hu});
    }
  });
  const Geometry grid = made.ct.geometry;
  nb::object label_array = nb::none();
  if (labels) label_array = as_numpy(AnyVolume(std::move(made.labels)));
  return nb::make_tuple(as_numpy(AnyVolume(std::move(made.ct))), grid, label_array);
}

std::vector<std::string> phantom_labels() {
  const auto names = phantom_label_names();
  return {names.begin(), names.end()};
}

}  // namespace

void add_files(nb::module_& core) {
  nb::class_<SeriesHeaders>(core, "SeriesHeaders")
      .def_ro("series_uid", &SeriesHeaders::series_uid)
      .def_ro("study_uid", &SeriesHeaders::study_uid)
      .def_ro("frame_of_reference_uid", &SeriesHeaders::frame_of_reference_uid);
  core.def("read", &read, nb::arg("path"), nb::arg("series"), nb::arg("single"), nb::arg("uneven"),
           nb::arg("nifti_frame"), nb::arg("threads"), nb::arg("options"));
  core.def("write_file", &write_file, nb::arg("path"), nb::arg("array"), nb::arg("grid"), nb::arg("compression"),
           nb::arg("metadata"), nb::arg("overwrite"), nb::arg("options"));
  core.def("write_series", &write_series, nb::arg("folder"), nb::arg("array"), nb::arg("grid"), nb::arg("source"),
           nb::arg("derivation"), nb::arg("background_hu"), nb::arg("deformed"), nb::arg("keep_frame_of_reference"),
           nb::arg("series_number").none(), nb::arg("series_description").none(), nb::arg("threads"),
           nb::arg("overwrite"), nb::arg("options"));
  core.def("info", &info, nb::arg("path"), nb::arg("single"), nb::arg("nifti_frame"));
  core.def("set_dicom_dictionary", &set_dicom_dictionary, nb::arg("path"));
  core.def("has_image_suffix", &has_image_suffix, nb::arg("path"));
  core.def("phantom", &phantom, nb::arg("size"), nb::arg("spacing"), nb::arg("seed"), nb::arg("noise_hu"),
           nb::arg("labels"), nb::arg("options"));
  core.def("phantom_labels", &phantom_labels);
}

}  // namespace tetwarp::python
