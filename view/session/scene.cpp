// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <limits>

#include "backend/factories.h"
#include "deform/fields/lattice_mesh.h"
#include "io/slice_view.h"
#include "view/session/coarse_volume.h"

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
  field_ = view(still_, Outside::background);
  source_ = setup.source;
  if (runs_on_device(setup.backend)) {
    device_source_ =
        std::make_unique<BackendVolume>(setup.backend, *setup.source.geometry, setup.source.type, setup.device);
    device_source_->take(setup.source);
    source_ = device_source_->view();
    exact_ = whole_volume(source_, grid_);
  } else {
    const glm::i64vec3 blocks = coarse_blocks(*setup.source.geometry);
    coarse_source_ = coarse_volume(setup.source, blocks);
    coarse_ = whole_volume(std::as_const(coarse_source_).view(), coarse_grid(grid_, blocks));
    if (std::max(grid_.size.x, grid_.size.y) > kMostMovingVoxels)
      moving_slices_ = slice_maker(coarse_grid(grid_, glm::i64vec3(2, 2, grid_.size.z > kMostMovingVoxels ? 2 : 1)));
  }
  slices_ = slice_maker(grid_);
}

std::unique_ptr<SliceMaker> Scene::slice_maker(const Geometry& grid) const {
  return std::make_unique<SliceMaker>(grid, target(source_, {}), view(still_, Outside::background),
                                      make_forward_resampler(setup_.backend, grid, setup_.device, setup_.limits),
                                      make_forward_resampler(setup_.backend, grid, setup_.device, setup_.limits));
}

Scene::Whole Scene::whole_volume(const ConstVolumeView& from, const Geometry& grid) const {
  Whole one;
  one.from = from;
  one.output = std::make_unique<BackendVolume>(setup_.backend, grid, from.type, setup_.device);
  one.resampler = make_forward_resampler(setup_.backend, grid, setup_.device, setup_.limits);
  one.renderer = make_renderer(setup_.backend, setup_.device, setup_.limits);
  return one;
}

Scene::~Scene() = default;

void Scene::set_field(const FieldView& field) {
  field_ = field;
  slices_->set_field(field);
  if (moving_slices_) moving_slices_->set_field(field);
  is_shown_ = is_exact_ = false;
}

void Scene::set_field(VertexField field) {
  kept_ = std::move(field);
  set_field(view(kept_, Outside::background));
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
  const std::int64_t size = grid_.size[slice.normal_axis], count = moving_slices_->grid().size[slice.normal_axis];
  coarse.voxel = slice.voxel / ((size + count - 1) / count);
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
  one.resampler->set_field(field_, options, control);
  const Update update = one.resampler->update({&whole, 1}, control);
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
              .jacobian_min = report.jacobian_min};
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

std::optional<glm::dvec3> worst_place(const VertexField& field) {
  const TetrahedralMesh mesh = mesh_of(field);
  std::optional<glm::dvec3> worst;
  double least = std::numeric_limits<double>::infinity();
  for (const glm::u32vec4& corners : mesh.tetrahedra) {
    glm::dmat4x3 before, after;
    for (int n = 0; n < 4; ++n) {
      before[n] = mesh.rest[corners[n]];
      after[n] = before[n] + glm::dvec3(mesh.displacement[corners[n]]);
    }
    const auto volume = [](const glm::dmat4x3& p) {
      return glm::determinant(glm::dmat3(p[0] - p[3], p[1] - p[3], p[2] - p[3]));
    };
    const double jacobian = volume(after) / volume(before);
    if (!(jacobian < least)) continue;
    least = jacobian;
    worst = 0.25 * (after[0] + after[1] + after[2] + after[3]);
  }
  return worst;
}

}  // namespace tetwarp::viewer
