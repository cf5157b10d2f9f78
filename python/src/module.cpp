// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "python/src/module.h"

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <map>
#include <string>
#include <vector>

#include "apps/cli/program.h"
#include "backend/backend.h"
#include "backend/devices.h"
#include "deform/value_counts.h"
#include "deform/version.h"
#include "python/src/arrays.h"
#include "python/src/calls.h"

namespace tetwarp::python {

namespace {

namespace nb = nanobind;

/// What is compiled in.
std::map<std::string, bool> compiled() {
  return {{"cuda", has_cuda()},
#ifdef TETWARP_WITH_DCMTK
          {"dicom", true},
#else
          {"dicom", false},
#endif
#ifdef TETWARP_WITH_OPENJPEG
          {"jpeg2000", true},
#else
          {"jpeg2000", false},
#endif
#ifdef TETWARP_WITH_ITK
          {"itk_transforms", true},
#else
          {"itk_transforms", false},
#endif
#ifdef TETWARP_WITH_VIEW
          {"viewer", true},
#else
          {"viewer", false},
#endif
#ifdef TETWARP_WITH_VTK
          {"vtk_xml", true}};
#else
          {"vtk_xml", false}};
#endif
}

std::map<double, std::uint64_t> count_values_of(const ConstArray& array, const Geometry& grid) {
  const ConstVolumeView volume = voxels_of(array, grid, "the labels");
  const WithoutGil released;
  return count_values(volume, {.threads = threads_of(0)});
}

}  // namespace

}  // namespace tetwarp::python

NB_MODULE(_core, core) {
  using namespace tetwarp;
  using namespace tetwarp::python;
  nanobind::set_leak_warnings(false);  // objects that live until the interpreter ends are no faults of the user
  watch_process();
  add_errors(core);
  add_geometry(core);
  add_fields(core);
  add_resampler(core);
  add_adjoint(core);
  add_files(core);
  add_simulation(core);
  add_render(core);
  add_view(core);
  core.def("version", &version);
  core.def("commit", &commit);
  core.def("compiled", &compiled);
  core.def("device_count", [] { return is_forked() ? 0 : device_count(); });
  core.def("describe_device", &describe_device, nanobind::arg("device"));
  core.def("run_program", [](std::vector<std::string> words) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const WithoutGil released;
    return apps::run_program(static_cast<int>(words.size()), arguments.data());
  });
  core.def("count_values", &count_values_of, nanobind::arg("array"), nanobind::arg("grid"));
  core.def("is_forked", &is_forked);
  core.def("chosen_backend", [](const std::string& backend) { return name_of(chosen(backend_choice(backend))); });
}
