// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "deform/resampler.h"
#include "io/overlay.h"
#include "io/preview_scale.h"
#include "io/slice_picture.h"
#include "view/session/picture.h"

namespace tetwarp::viewer {

/// Which volume slices show.
enum class Compared : std::uint8_t {
  after,       ///< the deformed one
  before,      ///< the undeformed one
  difference,  ///< deformed minus undeformed
  swipe        ///< the undeformed one at the left, the deformed one at the right
};

/// How slices look.
struct SliceLook {
  Window window;
  Compared compared = Compared::after;
  double swipe = 0.5;  ///< share of the columns that show the undeformed volume, 0 to 1
  std::optional<OverlayKind> overlay = {};
};

/// Makes slices of a deformed volume, of which nothing else is computed.
class SliceMaker {
 public:
  enum class Which : std::uint8_t { after, before };

  /// @param grid    of the deformed volume
  /// @param target  source and how it is sampled; the output is not used. The source must outlive this object
  /// @param still   a field that moves nothing
  /// @param after, before  resamplers onto the grid
  SliceMaker(const Geometry& grid, const Target& target, const FieldView& still,
             std::unique_ptr<ForwardResampler> after, std::unique_ptr<ForwardResampler> before);

  const Geometry& grid() const { return grid_; }
  /// Takes a field, which must not change until the next one is taken.
  void set_field(const FieldView& field);

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

  ForwardResampler& resampler(Which which);
  Part part(Which which, const Region& region);
  void lay_over(PaneImage& image, const Slice& slice, OverlayKind kind);
  void lay_lattice_over(PaneImage& image, const Slice& slice);
  Part map_of(const Slice& slice, OverlayKind kind);

  Geometry grid_;
  Target target_;
  FieldView field_;
  std::unique_ptr<ForwardResampler> after_, before_;
  bool knows_ = false;  ///< whether `after_` has the field
};

}  // namespace tetwarp::viewer
