// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_pass.h"

#include <algorithm>
#include <atomic>
#include <nlohmann/json.hpp>

#include "apps/deform/output_grid.h"
#include "deform/mass.h"

namespace tetwarp::apps {

namespace {

/// INPUT as it goes through the field with --preserve mass: in a real type that holds its values, so that they are
/// rounded once, when a part of it is done.
class MassInput {
 public:
  MassInput(const DeformInputs& inputs, const Geometry& output)
      : padding_(inputs.padding()),
        source_(inputs.grid(), type_of_mass(inputs.input->volume.type())),
        resampled_(output, source_.type()) {
    dispatch(inputs.input->volume.type(), [&](auto voxel) {
      const auto from = inputs.input->volume.as<decltype(voxel)>();
      const auto convert = [&](auto to) {
        using Real = typename decltype(to)::value_type;
        std::transform(from.begin(), from.end(), to.begin(), [](auto value) { return static_cast<Real>(value); });
      };
      source_.type() == VoxelType::f64 ? convert(source_.as<double>()) : convert(source_.as<float>());
    });
  }

  void take_part(Target& target) {
    target.source = std::as_const(source_).view();
    target.output = resampled_.view();
  }
  /// @param maps  of the slab that is resampled
  void set_maps(const Maps& maps) { maps_ = maps; }
  void finish(const Region& slices, const VolumeView& output) {
    saturated_ += preserve_mass(std::as_const(resampled_).view(), maps_, padding_, output, slices);
  }
  std::uint64_t saturated() const { return saturated_; }

 private:
  std::optional<PaddingRange> padding_;
  AnyVolume source_, resampled_;
  Maps maps_;
  std::atomic<std::uint64_t> saturated_ = 0;
};

/// One pass of all that goes through the field.
class Pass {
 public:
  Pass(const DeformRequest& request, const DeformHeaders& headers, const DeformInputs& inputs, const DeformField& field,
       DeformSinks& sinks, const Worker& worker)
      : request_(request), headers_(headers), inputs_(inputs), field_(field), sinks_(sinks), worker_(worker) {}

  DeformResult run(AnyVolume room);

 private:
  void resample_onto_output(Resampler& resampler, const Control& control, DeformResult& result);
  void resample_onto_own_grids(DeformResult& result);
  std::vector<MovedStructures> move_structures(Resampler& resampler);
  FieldCheck check(ForwardResampler& resampler, const Control& progress) const;

  /// What becomes of voxels beyond the lattice. What --grid fit adds to INPUT's grid lies there and is not refused.
  Outside outside() const {
    const bool grown = is_fitting_grid(options_.grid) && options_.outside == Outside::refuse;
    return grown ? Outside::background : options_.outside;
  }
  Control quiet() const { return {.stop = interrupt_token(), .stream = worker_.stream}; }

  const DeformRequest& request_;
  const DeformOptions& options_ = request_.options;
  const DeformHeaders& headers_;
  const DeformInputs& inputs_;
  const DeformField& field_;
  DeformSinks& sinks_;
  const Worker& worker_;
  const Limits limits_{.threads = options_.common.threads, .memory = options_.memory_bytes.value_or(0)},
      on_cpu_{.threads = options_.common.threads};
};

DeformResult Pass::run(AnyVolume room) {
  DeformResult result;
  Stage stage(options_.common, "resample");
  const AnyResampler resampler = make_resampler_for(field_.field, field_.grid, worker_, limits_);
  result.backend = name_of(resampler.backend());
  set_field(resampler, field_.field, outside(), {}, quiet());
  if (const auto* forward = std::get_if<VertexField>(&field_.field); forward && !headers_.points.empty())
    result.points = move_all_points(headers_.points, field_.grid, view(*forward, outside()), limits_, quiet());
  result.output = std::move(room);
  result.along = make_along_results(headers_.along.volumes, inputs_.along, field_.grid, options_.interpolation);
  resample_onto_output(*resampler, stage.control(), result);
  result.structures = move_structures(*resampler);
  resample_onto_own_grids(result);
  result.seconds = stage.seconds();
  if (!reports_quality(request_)) return result;
  Stage check_stage(options_.common, "check");
  result.check = check(resampler.forward(), check_stage.control());
  result.check_seconds = check_stage.seconds();
  return result;
}

void Pass::resample_onto_output(Resampler& resampler, const Control& progress, DeformResult& result) {
  std::vector<SliceRange> sampled_slices(sinks_.series ? static_cast<std::size_t>(field_.grid.size.z) : 0);
  std::vector<Target> targets = along_targets(headers_.along.volumes, inputs_.along, result.along, field_.grid, false);
  const Target main{.source = inputs_.input->volume.view(),
                    .output = result.output.view(),
                    .interpolation = options_.interpolation,
                    .background = inputs_.background,
                    .padding = inputs_.padding(),
                    .sampled_slices = sampled_slices};
  targets.insert(targets.begin(), main);
  std::optional<MassInput> mass;
  if (options_.preserve_mass) mass.emplace(inputs_, field_.grid).take_part(targets.front());
  Control control = progress;
  control.stream = worker_.stream;
  PartSink finished;
  if (sinks_.series || mass) {
    finished = [&](const Region& slices) {
      if (mass) mass->finish(slices, result.output.view());
      if (!sinks_.series) return;
      sinks_.outputs.write([&] {
        sinks_.series->write(std::as_const(result.output).view(), slices.begin.z, slices.end.z, sampled_slices,
                             options_.common.threads, {.stop = interrupt_token()});
      });
    };
  }
  sinks_.maps.run([&](const Region& slab, const Maps& maps) {
    if (mass) mass->set_maps(maps);
    result.report += resample_slab(resampler, slab, targets, maps, control, finished);
  });
  if (mass) result.report.clamped += mass->saturated();
}

void Pass::resample_onto_own_grids(DeformResult& result) {
  for (const Geometry& grid : own_grids_of(headers_.along.volumes)) {
    const AnyResampler resampler = make_resampler_for(field_.field, grid, worker_, limits_);
    set_field(resampler, field_.field, options_.outside, {}, quiet());
    const std::vector<Target> targets = along_targets(headers_.along.volumes, inputs_.along, result.along, grid, true);
    resampler->resample(whole(grid), targets, {}, quiet());
  }
}

/// Moves the structure sets that go along. @param resampler  has the field
std::vector<MovedStructures> Pass::move_structures(Resampler& resampler) {
  if (headers_.structures.empty()) return {};
  std::optional<PointMover> mover;
  if (const auto* forward = std::get_if<VertexField>(&field_.field))
    mover.emplace(field_.grid, view(*forward, outside()), on_cpu_, quiet());
  StructureMover structures(headers_.structures, mover ? &*mover : nullptr, inputs_.grid(), field_.grid, outside(),
                            options_.common.threads);
  if (structures.needs_inverse()) {
    MapStream inverse(field_.grid, sinks_.outputs);
    inverse.add(&Maps::inverse_mm, nullptr);
    inverse.run([&](const Region& slab, const Maps& maps) {
      resample_slab(resampler, slab, {}, maps, quiet());
      structures.reslice(maps.inverse_mm);
    });
  }
  return std::move(structures).finish();
}

/// Looks at the field, and where its inverse leads. @param resampler  holds the field
FieldCheck Pass::check(ForwardResampler& resampler, const Control& progress) const {
  const auto& field = std::get<VertexField>(field_.field);
  return {.quality = measure_quality(field, on_cpu_, progress),
          .trip = measure_round_trip(resampler, field, on_cpu_, quiet())};
}

}  // namespace

DeformSinks open_sinks(const DeformRequest& request, const DeformInputs& inputs, const DeformField& field,
                       DeformOutputs& outputs) {
  DeformSinks sinks{nullptr, MapStream(field.grid, outputs.set), outputs.set};
  if (request.series) {
    sinks.series = std::make_unique<DerivedSeriesWriter>(outputs.volume, field.grid, *inputs.headers,
                                                         input_derivation_of(request, inputs, field));
  }
  outputs.set.write([&] { add_maps(wanted_maps(request, outputs.maps), field.grid, sinks.series.get(), sinks.maps); });
  return sinks;
}

DeformResult resample(const DeformRequest& request, const DeformHeaders& headers, const DeformInputs& inputs,
                      const DeformField& field, AnyVolume room, DeformSinks& sinks, const Worker& worker) {
  return Pass(request, headers, inputs, field, sinks, worker).run(std::move(room));
}

DicomDerivation derivation_of(const DeformRequest& request, const DeformInputs& inputs, const DeformField& field) {
  const bool pull = is_pull(field.field), deformed = pull || !field.origin.identity;
  const char* what =
      !deformed ? "Resampled by the identity" : (pull ? "Deformed by a pull field" : "Deformed by a field of vertices");
  return {.field_sha256 = field.sha256,
          .parameters = std::string("outside=") + name_of(request.options.outside) +
                        (pull ? " direction=pull" : " direction=forward"),
          .description = what,
          .deformed = deformed,
          .background_hu = inputs.background,
          .form = request.options.dicom};
}

DicomDerivation input_derivation_of(const DeformRequest& request, const DeformInputs& inputs,
                                    const DeformField& field) {
  const DeformOptions& options = request.options;
  DicomDerivation of_input = derivation_of(request, inputs, field);
  of_input.parameters = "interpolation=" + std::string(name_of(options.interpolation)) +
                        " outside=" + name_of(options.outside) +
                        " background=" + nlohmann::json(inputs.background).dump() +
                        (is_pull(field.field) ? " direction=pull" : " direction=forward") +
                        (options.preserve_mass ? " preserve=mass" : "");
  of_input.description += std::string(", ") + name_of(options.interpolation) + " interpolation";
  return of_input;
}

}  // namespace tetwarp::apps
