// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "backend/backend.h"
#include "backend/devices.h"
#include "deform/render/renderer.h"
#include "view/session/slices.h"

namespace tetwarp::viewer {

/// What is known of the deformed volume when it has been made as a whole.
struct Quality {
  double coverage = 1;           ///< share of the voxels that got a value through the field
  std::uint64_t inverted = 0;    ///< tetrahedra that are turned inside out
  std::uint64_t degenerate = 0;  ///< tetrahedra without volume
  /// Least Jacobian determinant of a tetrahedron; empty for a pull field, which has none.
  std::optional<double> jacobian_min = 1;
};

/// What is seen of a volume and a field: exact slices, and pictures of the volume.
///
/// On a device the deformed volume is made as a whole for each picture of it. On the CPU slices are made alone, while
/// something moves from a volume with half the voxels on an axis, and a volume picture is first one of a volume with
/// fewer voxels, whose field is interpolated at its voxels; `make_exact` makes the whole one. One object serves one
/// thread at a time.
class Scene {
 public:
  /// Where and of what pictures are made.
  struct Setup {
    ConstVolumeView source;  ///< undeformed, one component, in host memory; must outlive the scene
    /// Labels that go with it, one component, in host memory; must outlive the scene.
    std::optional<ConstVolumeView> labels = {};
    double background = 0;  ///< value where nothing maps
    std::optional<PaddingRange> padding = {};
    BackendKind backend = BackendKind::cpu;
    int device = 0;
    Limits limits = {};
  };

  /// The field is one that moves nothing.
  /// @throws InputError for a source that cannot be resampled or rendered, DeviceError and NotCompiled
  explicit Scene(const Setup& setup);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// Grid of the deformed volume: that of the source, straightened.
  const Geometry& grid() const { return grid_; }
  /// Takes a field, of which nothing may change until the next one is taken. Voxels outside it are background.
  void set_field(const FieldView& field) { take_field(field); }
  /// Takes a field and keeps it.
  void keep_field(AnyField field);
  /// The field that was kept last.
  const AnyField& kept_field() const { return kept_; }
  /// Whether there are labels.
  bool has_labels() const { return labels_.has_value(); }

  /// The slice of a plane nearest to a point. @param at_mm  LPS mm, moved into the grid
  Slice slice_near(AnatomicalPlane plane, const glm::dvec3& at_mm) const;
  /// A picture of a slice, a pixel a voxel, as radiologists look at it.
  PaneImage slice(const Slice& slice, const SliceLook& look);
  /// The same on the CPU for what moves: of a large slice a pixel is the mean of four voxels, or of eight in two
  /// slices. On a device it is the whole slice.
  PaneImage moving_slice(const Slice& slice, const SliceLook& look);
  /// A window of grey levels that suits the volume.
  Window window() const;

  /// How the volume looks. @throws InputError for a style with a number out of its range
  void set_style(const RenderStyle& style);
  /// A picture of the volume, of the exact one if it is there.
  PaneImage volume(const ViewPlane& plane, const Control& control = {});
  /// What a pixel of that picture shows, LPS mm; empty where nothing is seen.
  std::optional<glm::dvec3> pick(const ViewPlane& plane, int column, int row);
  /// Whether pictures of the volume are those of the whole deformed volume.
  bool is_exact() const { return is_exact_; }
  /// Makes the whole deformed volume. @throws Cancelled, after which pictures are as they were
  void make_exact(const Control& control = {});
  /// What is known of the field; after `make_exact`.
  const Quality& quality() const { return quality_; }

  /// Values at the voxel nearest to a point of the deformed picture.
  struct Values {
    double after, before;
  };
  /// @return empty outside the grid
  std::optional<Values> values_at(const glm::dvec3& point_mm);
  /// From where the tissue came that is seen at a point: the owner's inverse map at the nearest voxel.
  /// @param point_mm  LPS mm  @return LPS mm; empty where nothing maps, and outside the grid
  std::optional<glm::dvec3> undeformed(const glm::dvec3& point_mm);

 private:
  /// A volume that is deformed as a whole, and who draws it.
  struct Whole {
    ConstVolumeView from;  ///< undeformed
    std::unique_ptr<BackendVolume> output;
    std::unique_ptr<Deformer> deformer;
    std::unique_ptr<Renderer> renderer;
    bool is_set = false;  ///< whether the renderer has the output
    /// Whose lattice is the grid of the output, if the field is to be interpolated at its voxels first.
    std::optional<VertexField> samples = {};
  };

  void take_field(const AnyFieldView& field);
  std::unique_ptr<BackendVolume> on_device(const ConstVolumeView& volume) const;
  Whole whole_volume(const ConstVolumeView& from, const Geometry& grid) const;
  std::unique_ptr<SliceMaker> slice_maker(const ConstVolumeView& source, const Geometry& grid) const;

  Target target(const ConstVolumeView& source, const VolumeView& output) const;
  Report deform(Whole& one, const FieldOptions& options, const Control& control) const;
  void show_volume();
  std::optional<glm::i64vec3> voxel_at(const glm::dvec3& point_mm) const;

  Setup setup_;
  Geometry grid_;
  AffineMap index_from_point_;
  VertexField still_;
  AnyField kept_;
  AnyFieldView field_;
  std::unique_ptr<BackendVolume> device_source_, device_labels_;  ///< only on a device
  ConstVolumeView source_;                                        ///< undeformed, where the backend works
  std::optional<ConstVolumeView> labels_;
  std::unique_ptr<SliceMaker> slices_, moving_slices_;  ///< `moving_slices_` only on the CPU, of large volumes
  AnyVolume half_source_, coarse_source_;               ///< only on the CPU; the first of large volumes
  std::optional<Whole> coarse_;                         ///< only on the CPU
  std::optional<Whole> exact_;                          ///< on the CPU when it is asked for
  const Whole* drawn_ = nullptr;                        ///< the one that the last picture shows
  RenderStyle style_;
  bool is_shown_ = false;  ///< whether the volume that is drawn has it
  bool is_exact_ = false;
  Quality quality_;
};

}  // namespace tetwarp::viewer
