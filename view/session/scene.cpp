// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/scene.h"

#include <algorithm>
#include <cmath>

#include "deform/fields/lattice_mesh.h"
#include "io/slice_view.h"
#include "view/session/coarse_volume.h"
#include "view/session/sampled_field.h"

namespace tetwarp::viewer {

namespace {

/// A lattice over the grid that moves nothing.
VertexField still_field(const Geometry& grid) {
  VertexField field;
  const std::int64_t longest = std::max(grid.size.x, std::max(grid.size.y, grid.size.z));
  field.lattice = lattice_over(grid, std::max<std::int64_t>(longest - 1, 1));
  field.displacement.assign(static_cast<std::size_t>(voxel_count(field.lattice)), glm::vec3(0));
  return field;
}

}  // namespace

Scene::Scene(const Setup& setup)
    : setup_(setup),
      grid_(straightened(*setup.source.geometry)),
      index_from_point_(index_from_point(grid_)),
      still_(still_field(grid_)) {
  require(setup.source.components == 1,
          "a volume to look at has one value a voxel, found " + std::to_string(setup.source.components));
  if (setup.labels) {
    require(setup.labels->components == 1,
            "labels have one value a voxel, found " + std::to_string(setup.labels->components));
    const Geometry &grid = *setup.source.geometry, &of_labels = *setup.labels->geometry;
    require(same_grid(of_labels, grid, 0.01 * std::min({grid.spacing.x, grid.spacing.y, grid.spacing.z})),
            "labels lie on the grid of the volume, " + to_string(grid.size) + " voxels, found " +
                to_string(of_labels.size) + ", or another place");
    require(setup.labels->type != VoxelType::f32 && setup.labels->type != VoxelType::f64,
            "labels are whole numbers; these are floating-point ones");
  }
  field_ = view(still_, Outside::background);
  source_ = setup.source;
  labels_ = setup.labels;
  if (runs_on_device(setup.backend)) {
    device_source_ = on_device(setup.source);
    source_ = device_source_->view();
    if (labels_) {
      device_labels_ = on_device(*setup.labels);
      labels_ = device_labels_->view();
    }
    exact_ = whole_volume(source_, grid_);
  } else {
    const glm::i64vec3 blocks = coarse_blocks(*setup.source.geometry);
    coarse_source_ = coarse_volume(setup.source, blocks);
    coarse_ = whole_volume(std::as_const(coarse_source_).view(), coarse_grid(grid_, blocks));
    coarse_->samples = VertexField{*coarse_->output->view().geometry, {}};
    if (std::max(grid_.size.x, grid_.size.y) > kMostMovingVoxels) {
      const glm::i64vec3 halves = moving_blocks(*setup.source.geometry);
      half_source_ = coarse_volume(setup.source, halves);
      moving_slices_ = slice_maker(std::as_const(half_source_).view(), coarse_grid(grid_, halves));
    }
  }
  slices_ = slice_maker(source_, grid_);
}

/// A copy where the backend works.
std::unique_ptr<BackendVolume> Scene::on_device(const ConstVolumeView& volume) const {
  auto copy = std::make_unique<BackendVolume>(setup_.backend, *volume.geometry, volume.type, setup_.device);
  copy->take(volume);
  return copy;
}

/// @param grid  of the deformed volume; where it is that of the source, voxels are sampled with vectors
std::unique_ptr<SliceMaker> Scene::slice_maker(const ConstVolumeView& source, const Geometry& grid) const {
  SliceMaker::Setup setup;
  setup.grid = grid;
  setup.target = target(source, {});
  if (labels_) setup.labels = Target{.source = *labels_, .output = {}, .interpolation = Interpolation::vote};
  setup.still = view(still_, Outside::background);
  setup.deformer = std::make_unique<Deformer>(setup_.backend, grid, setup_.device, setup_.limits);
  setup.before = make_forward_resampler(setup_.backend, grid, setup_.device, setup_.limits);
  return std::make_unique<SliceMaker>(std::move(setup));
}

Scene::Whole Scene::whole_volume(const ConstVolumeView& from, const Geometry& grid) const {
  Whole one;
  one.from = from;
  one.output = std::make_unique<BackendVolume>(setup_.backend, grid, from.type, setup_.device);
  one.deformer = std::make_unique<Deformer>(setup_.backend, grid, setup_.device, setup_.limits);
  one.renderer = make_renderer(setup_.backend, setup_.device, setup_.limits);
  return one;
}

Scene::~Scene() = default;

void Scene::take_field(const AnyFieldView& field) {
  field_ = field;
  slices_->set_field(field);
  if (moving_slices_) moving_slices_->set_field(field);
  is_shown_ = is_exact_ = false;
}

void Scene::keep_field(AnyField field) {
  kept_ = std::move(field);
  take_field(view_of(kept_));
}

Slice Scene::slice_near(AnatomicalPlane plane, const glm::dvec3& at_mm) const {
  Slice slice = middle_slice(grid_, plane);
  const double index = index_from_point_(at_mm)[slice.normal_axis];
  slice.voxel =
      std::clamp<std::int64_t>(std::llround(std::clamp(index, -1.0, 1e6)), 0, grid_.size[slice.normal_axis] - 1);
  return slice;
}

Target Scene::target(const ConstVolumeView& source, const VolumeView& output) const {
  return {.source = source, .output = output, .background = setup_.background, .padding = setup_.padding};
}

PaneImage Scene::slice(const Slice& slice, const SliceLook& look) { return slices_->picture(slice, look); }

PaneImage Scene::moving_slice(const Slice& slice, const SliceLook& look) {
  if (!moving_slices_) return slices_->picture(slice, look);
  Slice coarse = middle_slice(moving_slices_->grid(), slice.plane);
  coarse.voxel = slice.voxel / moving_blocks(*setup_.source.geometry)[slice.normal_axis];
  return moving_slices_->picture(coarse, look);
}

Window Scene::window() const { return choose_window(setup_.source); }

void Scene::set_style(const RenderStyle& style) {
  require_valid(style.transfer);
  style_ = style;
  if (exact_) exact_->renderer->set_style(style_);
  if (!coarse_) return;
  RenderStyle quick = style;  // its voxels are large, and it is seen for a moment
  quick.step_voxels = 1;
  coarse_->renderer->set_style(quick);
}

/// Brings the volume that is drawn up to date.
void Scene::show_volume() {
  if (is_exact_) {
    drawn_ = &*exact_;
    return;
  }
  Whole& shown = coarse_ ? *coarse_ : *exact_;
  drawn_ = &shown;
  if (is_shown_) return;
  deform(shown, {.jacobian_range = false}, {});
  is_shown_ = true;
}

/// Deforms a volume by the field, and has its renderer see what changed.
Report Scene::deform(Whole& one, const FieldOptions& options, const Control& control) const {
  const Target whole = target(one.from, one.output->view());
  AnyFieldView field = field_;
  if (const auto* const forward = std::get_if<FieldView>(&field_);
      one.samples && forward && sample_field(*forward, *one.samples))
    field = view(*one.samples, forward->outside);
  one.deformer->set_field(field, options, control);
  const Update update = one.deformer->update({&whole, 1}, control);
  if (one.is_set) {
    one.renderer->update_volume(update.changed, control);
  } else {
    one.renderer->set_volume(one.output->view(), control);
    one.is_set = true;
  }
  return update.report;
}

PaneImage Scene::volume(const ViewPlane& plane, const Control& control) {
  show_volume();
  PaneImage image{plane.width, plane.height, false, {}};
  image.pixels.resize(3 * static_cast<std::size_t>(plane.width) * static_cast<std::size_t>(plane.height));
  drawn_->renderer->render(plane, image.pixels, control);
  return image;
}

std::optional<glm::dvec3> Scene::pick(const ViewPlane& plane, int column, int row) {
  show_volume();
  return drawn_->renderer->pick(plane, column, row);
}

void Scene::make_exact(const Control& control) {
  if (is_exact_) return;
  if (!exact_) {
    exact_ = whole_volume(source_, grid_);
    if (!style_.transfer.points.empty()) exact_->renderer->set_style(style_);
  }
  const Report report = deform(*exact_, {}, control);
  is_exact_ = is_shown_ = true;
  quality_ = {.coverage = static_cast<double>(report.covered) / static_cast<double>(voxel_count(grid_)),
              .inverted = report.inverted,
              .degenerate = report.degenerate,
              .jacobian_min = {}};
  if (std::holds_alternative<FieldView>(field_)) quality_.jacobian_min = report.jacobian_min;
}

std::optional<glm::i64vec3> Scene::voxel_at(const glm::dvec3& point_mm) const {
  const glm::dvec3 index = glm::round(index_from_point_(point_mm));
  for (int axis = 0; axis < 3; ++axis)
    if (!(index[axis] >= 0 && index[axis] < static_cast<double>(grid_.size[axis]))) return std::nullopt;
  return glm::i64vec3(index);
}

std::optional<Scene::Values> Scene::values_at(const glm::dvec3& point_mm) {
  const std::optional<glm::i64vec3> voxel = voxel_at(point_mm);
  if (!voxel) return std::nullopt;
  return Values{slices_->value(*voxel, SliceMaker::Which::after), slices_->value(*voxel, SliceMaker::Which::before)};
}

std::optional<glm::dvec3> Scene::undeformed(const glm::dvec3& point_mm) {
  const std::optional<glm::i64vec3> voxel = voxel_at(point_mm);
  if (!voxel) return std::nullopt;
  const glm::vec3 by = slices_->inverse_mm(*voxel);
  if (std::isnan(by.x)) return std::nullopt;
  return point_mm + glm::dvec3(by);
}

}  // namespace tetwarp::viewer
