// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <array>
#include <filesystem>
#include <optional>

#include "backend/factories.h"
#include "io/transfer_file.h"
#include "python/src/arrays.h"
#include "python/src/calls.h"
#include "python/src/module.h"

namespace tetwarp::python {

namespace {

struct View {
  double angle, elevation, zoom;
  std::array<int, 2> size;
  std::optional<double> step;
  std::array<double, 3> background;
};

/// A picture [height, width, 3] of uint8 of a volume, seen by parallel rays.
nb::object render(const ConstArray& array, const Geometry& grid, const std::string& transfer, const View& view,
                  const std::string& backend, int device, int threads, const CallOptions& options) {
  const ConstVolumeView volume = voxels_of(array, grid, "the volume");
  const Camera camera{.angle_deg = view.angle,
                      .elevation_deg = view.elevation,
                      .zoom = view.zoom,
                      .width = view.size[0],
                      .height = view.size[1]};
  std::vector<std::uint8_t> pixels;
  run_call(options, false, [&](const Control& control) {
    const ViewPlane plane = view_plane(camera, grid);
    const bool is_file = std::filesystem::path(transfer).extension() == ".json";
    const RenderStyle style{.transfer = is_file ? read_transfer_file(transfer) : transfer_function(transfer),
                            .step_voxels = view.step,
                            .background = {view.background[0], view.background[1], view.background[2]}};
    const BackendKind kind = kind_of(backend);
    const auto renderer = make_renderer(kind, device, {.threads = threads_of(threads)});
    renderer->set_volume(volume, control);
    renderer->set_style(style);
    pixels.resize(static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height) * 3);
    renderer->render(plane, pixels, control);
  });
  return as_numpy<std::uint8_t>(std::move(pixels),
                                {static_cast<std::size_t>(view.size[1]), static_cast<std::size_t>(view.size[0]), 3});
}

}  // namespace

void add_render(nb::module_& core) {
  nb::class_<View>(core, "View")
      .def(
          "__init__",
          [](View* self, double angle, double elevation, double zoom, std::array<int, 2> size,
             std::optional<double> step,
             std::array<double, 3> background) { new (self) View{angle, elevation, zoom, size, step, background}; },
          nb::arg("angle"), nb::arg("elevation"), nb::arg("zoom"), nb::arg("size"), nb::arg("step").none(),
          nb::arg("background"));
  core.def("render", &render, nb::arg("array"), nb::arg("grid"), nb::arg("transfer"), nb::arg("view"),
           nb::arg("backend"), nb::arg("device"), nb::arg("threads"), nb::arg("options"));
}

}  // namespace tetwarp::python
