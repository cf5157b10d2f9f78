// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "io/overlay.h"
#include "io/preview_scale.h"
#include "io/slice_picture.h"
#include "view/session/deformer.h"
#include "view/session/picture.h"

namespace tetwarp::viewer {

/// Which volume slices show.
enum class Compared : std::uint8_t {
  after,       ///< the deformed one
  before,      ///< the undeformed one
  difference,  ///< deformed minus undeformed
  swipe        ///< the undeformed one at the left, the deformed one at the right
};

/// What may lie over slices.
enum class Layer : std::uint8_t {
  lattice,   ///< cells of the deformed lattice
  jacobian,  ///< how much the volume grew or shrank
  folds,     ///< where several places map to one
  coverage,  ///< where no value came through the field
  labels,    ///< labels, which go with the volume, as colours
  contours   ///< and as lines around them
};

/// How slices look.
struct SliceLook {
  Window window;
  Compared compared = Compared::after;
  double swipe = 0.5;  ///< share of the columns that show the undeformed volume, 0 to 1
  std::optional<Layer> layer = {};
};

/// Makes slices of a deformed volume, of which nothing else is computed.
class SliceMaker {
 public:
  enum class Which : std::uint8_t { after, before };

  /// What slices are made of.
  struct Setup {
    Geometry grid;                       ///< of the deformed volume
    Target target;                       ///< source and how it is sampled; the output is not used
    std::optional<Target> labels;        ///< labels, and how they are sampled
    FieldView still;                     ///< a field that moves nothing
    std::unique_ptr<Deformer> deformer;  ///< onto the grid
    std::unique_ptr<ForwardResampler> before;
  };
  /// Sources and the field must outlive this object.
  explicit SliceMaker(Setup setup);

  const Geometry& grid() const { return setup_.grid; }
  /// Takes a field, which must not change until the next one is taken.
  void set_field(const AnyFieldView& field);

  /// A picture of a slice, a pixel a voxel, as radiologists look at it.
  PaneImage picture(const Slice& slice, const SliceLook& look);
  /// The value of a voxel.
  double value(const glm::i64vec3& voxel, Which which);
  /// Undeformed minus deformed place of a voxel, LPS mm; NaN where nothing maps.
  glm::vec3 inverse_mm(const glm::i64vec3& voxel);

 private:
  /// A part of the grid.
  struct Part {
    Region region;
    std::vector<std::byte> bytes;
    VolumeView view(const Geometry& grid, VoxelType type, int components = 1);
  };

  Resampler& resampler(Which which);
  Part part(const Target& target, Which which, const Region& region);
  void lay_over(PaneImage& image, const Slice& slice, OverlayKind kind);
  void lay_lattice_over(PaneImage& image, const Slice& slice);
  void lay_labels_over(PaneImage& image, const Slice& slice, Which which, const SliceLook& look,
                       const std::pair<std::int64_t, std::int64_t>& columns);
  Part map_of(const Slice& slice, OverlayKind kind);

  Setup setup_;
  AnyFieldView field_;
  bool knows_ = false;  ///< whether the deformer has the field
};

}  // namespace tetwarp::viewer
