// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cmath>
#include <map>
#include <mutex>

#include "apps/deform/output_grid.h"
#include "apps/fields/any_field.h"
#include "backend/factories.h"
#include "deform/field_quality.h"
#include "deform/mass.h"
#include "python/src/calls.h"
#include "python/src/fields.h"
#include "python/src/module.h"
#include "python/src/words.h"

namespace tetwarp::python {

namespace {

/// One volume of a call, as Python describes it.
struct TargetArrays {
  ConstArray source;
  Geometry grid;  ///< of the source
  Array output;
  std::string interpolation;
  double background;
  std::optional<std::array<double, 2>> padding;
};

nb::object number_or_none(double value) { return std::isfinite(value) ? nb::cast(value) : nb::none(); }

nb::dict as_dict(const Report& report) {
  nb::dict dict;
  dict["covered"] = report.covered;
  dict["uncovered"] = report.uncovered;
  dict["clamped"] = report.clamped;
  dict["padded"] = report.padded;
  dict["conflicts"] = report.conflicts;
  dict["inverted"] = report.inverted;
  dict["degenerate"] = report.degenerate;
  dict["multiply_owned"] = report.multiply_owned ? nb::cast(*report.multiply_owned) : nb::none();
  dict["jacobian_min"] = number_or_none(report.jacobian_min);
  dict["jacobian_max"] = number_or_none(report.jacobian_max);
  return dict;
}

nb::dict as_dict(const Residuals& residuals) {
  nb::dict dict;
  dict["points"] = residuals.points;
  dict["mean_mm"] = residuals.mean;
  dict["percentile_99_mm"] = residuals.percentile_99;
  dict["largest_mm"] = residuals.largest;
  return dict;
}

/// The resampler behind `tetwarp.Resampler` and `tetwarp.PullResampler`, with what it refers to.
class BoundResampler {
 public:
  BoundResampler(const std::string& backend, bool pulls, const Geometry& output, int device, int threads,
                 std::uint64_t memory)
      : output_(output), limits_{.threads = threads_of(threads), .memory = memory} {
    const WithoutGil released;
    const BackendKind kind = kind_of(backend);
    resampler_ = AnyResampler(kind, pulls ? Direction::pull : Direction::forward, output_, device, limits_);
  }

  std::string backend() const { return name_of(resampler_.backend()); }

  void set_field(const std::optional<Geometry>& lattice, const std::optional<ConstArray>& displacement,
                 const std::optional<MeshArrays>& mesh, const std::optional<ConstArray>& replaced,
                 const std::string& outside, bool jacobian_range, const CallOptions& options) {
    const std::unique_lock lock = in_use();
    is_set_ = false;  // until the field is taken: what it referred to is replaced
    const FieldView field = forward_.hold(lattice, displacement, mesh, replaced, outside);
    run_call(options, forward_.is_small(), [&](const Control& control) {
      resampler_.forward().set_field(field, {.jacobian_range = jacobian_range}, control);
    });
    is_set_ = true;
  }

  void set_pull_field(const Geometry& grid, const ConstArray& displacement, const std::string& outside,
                      const CallOptions& options) {
    const std::unique_lock lock = in_use();
    is_set_ = false;
    pull_grid_ = grid;
    pulled_ = displacement;
    const PullFieldView field{.grid = &pull_grid_,
                              .displacement = vectors_of(displacement, pull_grid_),
                              .outside = outside_of(outside),
                              .memory = memory_of(displacement, "the displacement")};
    run_call(options, voxel_count(grid) < kSmallCall,
             [&](const Control& control) { resampler_.pull().set_field(field, control); });
    is_set_ = true;
  }

  nb::dict resample(const std::vector<TargetArrays>& targets, const std::map<std::string, Array>& maps,
                    const std::optional<std::array<std::array<std::int64_t, 3>, 2>>& region,
                    const CallOptions& options) {
    Region part = whole(output_);
    if (region) {
      const auto& [begin, end] = *region;
      part = {{begin[0], begin[1], begin[2]}, {end[0], end[1], end[2]}};
      require(contains(whole(output_), part) && voxel_count(part) > 0,
              "the region is empty or reaches beyond the output");
    }
    std::vector<Target> views;
    for (std::size_t n = 0; n < targets.size(); ++n) {
      const TargetArrays& one = targets[n];
      const std::string name = n == 0 ? "the volume" : "volume " + std::to_string(n + 1);
      views.push_back({.source = voxels_of(one.source, one.grid, name),
                       .output = voxels_of(one.output, output_, "the output of " + name),
                       .interpolation = interpolation_of(one.interpolation),
                       .background = one.background});
      if (one.padding) views.back().padding = PaddingRange{(*one.padding)[0], (*one.padding)[1]};
    }
    Maps wanted;
    for (const auto& [name, array] : maps) map_of(wanted, name) = voxels_of(array, output_, "the map \"" + name + "\"");
    const std::unique_lock lock = in_use();
    require_set();
    require_apart(views, wanted);
    Report report;
    run_call(options, voxel_count(part) < kSmallCall,
             [&](const Control& control) { report = resampler_->resample(part, views, wanted, control); });
    return as_dict(report);
  }

  /// What a forward field is like, of the field that is set and its own values in host memory.
  nb::dict check(const VertexField& field, const CallOptions& options) {
    FieldQuality quality;
    RoundTrip trip;
    const std::unique_lock lock = in_use();
    require_set();
    run_call(options, false, [&](const Control& control) {
      const Limits on_cpu{.threads = limits_.threads};
      quality = measure_quality(field, on_cpu, control);
      trip = measure_round_trip(resampler_.forward(), field, on_cpu, control);
    });
    nb::dict dict;
    dict["largest_stretch"] = quality.largest_stretch;
    dict["jacobian_edges"] = std::vector<double>(FieldQuality::kEdges.begin(), FieldQuality::kEdges.end());
    const auto shares = quality.shares();
    dict["jacobian_shares"] = std::vector<double>(shares.begin(), shares.end());
    dict["forward_after_inverse"] = as_dict(trip.forward_after_inverse);
    dict["inverse_after_forward"] = as_dict(trip.inverse_after_forward);
    return dict;
  }

 private:
  std::unique_lock<std::timed_mutex> in_use() {
    if (is_forked() && resampler_.backend() == BackendKind::cuda) {
      throw DeviceError(
          "this resampler was made before the process was forked, and CUDA does not work here; make it here");
    }
    require(!is_in_progress_callable(), "a progress callable cannot call a resampler; note the share, and return");
    return locked(mutex_);
  }

  void require_set() const { require(is_set_, "no field is set; call set_field first"); }

  /// Bytes of an array in memory.
  struct Extent {
    const std::byte* begin;
    const std::byte* end;
    std::string name;
    bool is_written;
  };
  template <class View>
  static void add(std::vector<Extent>& extents, const View& view, const std::string& name, bool is_written) {
    if (!view.voxels) return;
    const auto bytes = static_cast<std::size_t>(voxel_count(view.buffered)) *
                       static_cast<std::size_t>(view.components) * size_bytes(view.type);
    extents.push_back({view.voxels, view.voxels + bytes, name, is_written});
  }

  /// Refuses arrays that are written where another one lies: what comes of them would depend on threads.
  void require_apart(const std::vector<Target>& targets, const Maps& maps) const {
    std::vector<Extent> extents;
    for (std::size_t n = 0; n < targets.size(); ++n) {
      const std::string number = targets.size() > 1 ? " " + std::to_string(n + 1) : "";
      add(extents, targets[n].source, "volume" + number, false);
      add(extents, targets[n].output, "out of volume" + number, true);
    }
    add(extents, maps.coverage, "the map \"coverage\"", true);
    add(extents, maps.inverse_mm, "the map \"inverse\"", true);
    add(extents, maps.jacobian, "the map \"jacobian\"", true);
    add(extents, maps.owners, "the map \"folds\"", true);
    if (const auto& displacement = pulled_ ? pulled_ : forward_.displacement(); displacement) {
      const auto* begin = static_cast<const std::byte*>(displacement->data());
      extents.push_back({begin, begin + displacement->nbytes(), "the displacement", false});
    }
    for (std::size_t a = 0; a < extents.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const bool apart = extents[a].end <= extents[b].begin || extents[b].end <= extents[a].begin;
        require(apart || (!extents[a].is_written && !extents[b].is_written),
                extents[b].name + " shares memory with " + extents[a].name + "; pass another array");
      }
    }
  }

  static VolumeView& map_of(Maps& maps, const std::string& name) {
    if (name == "coverage") return maps.coverage;
    if (name == "inverse") return maps.inverse_mm;
    if (name == "jacobian") return maps.jacobian;
    require(name == "folds",
            "there is no map \"" + name + "\"; expected \"coverage\", \"inverse\", \"jacobian\" or \"folds\"");
    return maps.owners;
  }

  Geometry output_, pull_grid_;
  Limits limits_;
  AnyResampler resampler_;
  ForwardArrays forward_;
  std::optional<ConstArray> pulled_;  ///< keeps the values of a pull field
  bool is_set_ = false;
  std::timed_mutex mutex_;
};

std::uint64_t keep_mass(const ConstArray& hu, const ConstArray& coverage, const ConstArray& jacobian,
                        const Array& output, const Geometry& grid,
                        const std::optional<std::array<double, 2>>& padding) {
  Maps maps;
  const auto writable = [](const ConstVolumeView& view) {
    return VolumeView{view.geometry, view.buffered, view.type, view.components, const_cast<std::byte*>(view.voxels),
                      view.memory};
  };
  maps.coverage = writable(voxels_of(coverage, grid, "coverage"));
  maps.jacobian = writable(voxels_of(jacobian, grid, "jacobian"));
  const ConstVolumeView from = voxels_of(hu, grid, "the volume");
  const VolumeView to = voxels_of(output, grid, "the output");
  std::optional<PaddingRange> range;
  if (padding) range = PaddingRange{(*padding)[0], (*padding)[1]};
  const WithoutGil released;
  return preserve_mass(from, maps, range, to, whole(grid));
}

}  // namespace

void add_resampler(nb::module_& core) {
  nb::class_<TargetArrays>(core, "Target")
      .def(
          "__init__",
          [](TargetArrays* self, ConstArray source, const Geometry& grid, Array output, std::string interpolation,
             double background, std::optional<std::array<double, 2>> padding) {
            new (self)
                TargetArrays{std::move(source), grid, std::move(output), std::move(interpolation), background, padding};
          },
          nb::arg("source"), nb::arg("grid"), nb::arg("output"), nb::arg("interpolation"), nb::arg("background"),
          nb::arg("padding").none());
  nb::class_<BoundResampler>(core, "Resampler")
      .def(nb::init<const std::string&, bool, const Geometry&, int, int, std::uint64_t>(), nb::arg("backend"),
           nb::arg("pulls"), nb::arg("output"), nb::arg("device"), nb::arg("threads"), nb::arg("memory"))
      .def_prop_ro("backend", &BoundResampler::backend)
      .def("set_field", &BoundResampler::set_field, nb::arg("lattice").none(), nb::arg("displacement").none(),
           nb::arg("mesh").none(), nb::arg("replaced").none(), nb::arg("outside"), nb::arg("jacobian_range"),
           nb::arg("options"))
      .def("set_pull_field", &BoundResampler::set_pull_field, nb::arg("grid"), nb::arg("displacement"),
           nb::arg("outside"), nb::arg("options"))
      .def("resample", &BoundResampler::resample, nb::arg("targets"), nb::arg("maps"), nb::arg("region").none(),
           nb::arg("options"))
      .def("check", &BoundResampler::check, nb::arg("field"), nb::arg("options"));
  core.def(
      "fitting_grid",
      [](const Geometry& input, const VertexField& field, const std::string& outside) {
        const WithoutGil released;
        return apps::fitting_grid(input, field, outside_of(outside));
      },
      nb::arg("input"), nb::arg("field"), nb::arg("outside"));
  core.def(
      "hash_field",
      [](const VertexField& field, int threads) {
        const WithoutGil released;
        return apps::hash_field(field, threads_of(threads));
      },
      nb::arg("field"), nb::arg("threads"));
  core.def(
      "hash_pull_field",
      [](const Geometry& grid, const ConstArray& displacement, int threads) {
        const PullField field = pull_field_of(grid, displacement);
        const WithoutGil released;
        return apps::hash_field(field, threads_of(threads));
      },
      nb::arg("grid"), nb::arg("displacement"), nb::arg("threads"));
  core.def("type_of_mass", [](const ConstArray& array, const Geometry& grid) {
    return to_string(type_of_mass(voxels_of(array, grid, "the volume").type));
  });
  core.def("preserve_mass", &keep_mass, nb::arg("hu"), nb::arg("coverage"), nb::arg("jacobian"), nb::arg("output"),
           nb::arg("grid"), nb::arg("padding").none());
}

}  // namespace tetwarp::python
