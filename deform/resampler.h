// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>

#include "deform/vertex_field.h"
#include "deform/volume.h"

namespace tetwarp {

/// What is made of the voxels around a place (docs/design/definition.md). `vote` is for label maps: the linear weights
/// are summed for each label, the largest sum wins, and of equal sums the one of the smaller label. No label is made
/// up.
enum class Interpolation : std::uint8_t { nearest, linear, cubic, vote };

/// Stored values from `low` to `high` are no data (DICOM Pixel Padding Value and Range Limit, PS3.3 C.7.5.1.1.2).
struct PaddingRange {
  double low = 0, high = 0;
};

/// First and last slice (k) of the source that some voxel of an output slice was interpolated from; empty while first >
/// last.
struct SliceRange {
  std::int64_t first = INT64_MAX, last = INT64_MIN;
};

/// One volume through the field. Any number of them share owner and undeformed coordinate.
///
/// A voxel may have several values (`components` of both views): each is interpolated alone, as if it were a volume of
/// its own. Vectors are not turned.
struct Target {
  ConstVolumeView source;  ///< must buffer `Resampler::source_region`
  VolumeView output;       ///< on the resampler's geometry, of the source's type and components; must buffer the region
  Interpolation interpolation = Interpolation::linear;
  double background = 0;  ///< of every component, where nothing maps; rounded and saturated to the voxel type
  std::optional<PaddingRange> padding = {};   ///< never mixed into tissue: see core/sample.h; for one component only
  std::span<SliceRange> sampled_slices = {};  ///< one per slice of the output geometry, or none: grown by each call
};

/// Further results on the output geometry. A view without voxels is not wanted.
struct Maps {
  VolumeView coverage =
      {};  ///< u8: 1 where the voxel got a value through the field (from the first target's source), else 0
  VolumeView inverse_mm = {};  ///< f32, 3 components: undeformed minus deformed point, LPS mm; NaN where nothing maps
  VolumeView jacobian =
      {};  ///< f32: determinant of the owner's forward map, negative where inverted; NaN where nothing maps
  VolumeView owners = {};  ///< u16: tetrahedra that own the voxel; more than 1 is a fold; saturates
};

/// How a backend found the owners of the voxels asked for. The result does not depend on it; pull fields have none.
struct Paths {
  std::uint64_t gathered = 0;  ///< predicted and proved in float, rasterised tile by tile, or known to have no owner
  std::uint64_t walked = 0;    ///< no prediction held: sought with exact integers
  std::uint64_t claimed = 0;   ///< by every tetrahedron that may own them
};

/// What happened. Voxel counts are of the region asked for and the first target; the rest describes the whole field.
struct Report {
  std::uint64_t covered = 0;    ///< voxels that got a value through the field
  std::uint64_t uncovered = 0;  ///< voxels that got the background
  std::uint64_t clamped = 0;    ///< voxels of which a value did not fit the voxel type and was saturated
  std::uint64_t padded = 0;     ///< voxels with padding among the samples that count: value of the nearest sample
  std::uint64_t conflicts =
      0;  ///< Outside::rest only: voxels outside the undeformed lattice that a tetrahedron moved into
  std::uint64_t inverted = 0;    ///< tetrahedra of the field turned inside out
  std::uint64_t degenerate = 0;  ///< tetrahedra of the field without volume: they own nothing
  std::optional<std::uint64_t> multiply_owned =
      {};  ///< voxels with more than one owner, where Maps::owners was asked for
  double jacobian_min =
      std::numeric_limits<double>::infinity();  ///< over all tetrahedra of the field, as Maps::jacobian has it
  double jacobian_max = -std::numeric_limits<double>::infinity();
  Paths paths;  ///< the one part that backends, limits and splits change

  /// Regions of one field add up to the same report, whatever the split.
  Report& operator+=(const Report& other);
};

/// Progress and cancellation. Never changes a bit of the result.
struct Control {
  std::function<void(double)> progress = {};  ///< 0 to 1, monotone, one call at a time, from any thread
  std::stop_token stop = {};                  ///< asked between tiles: the call throws Cancelled
  /// For resample: told of each part of the region that is done, so that it can be used while the rest is made. Parts
  /// are whole slices of the region, none twice, together all of it; what is in host memory has its last value then,
  /// and so have the `sampled_slices`. Called from any thread, perhaps several at a time; what it throws ends the call.
  std::function<void(const Region&)> finished = {};
  /// A cudaStream_t (deform/ knows no CUDA): the work is queued there, after what is queued already, and the call
  /// returns when it is done. Null: the default stream. Ignored by the CPU.
  void* stream = nullptr;
  /// For set_field: whether reports state jacobian_min and jacobian_max. Inverted tetrahedra are always counted.
  bool jacobian_range = true;
};

/// Sends volumes through a field onto one output geometry; takes field after field.
///
/// A CUDA resampler takes fields, sources, outputs and maps in host or device memory, any mixture; device memory must
/// be of its own device, and is used where it is. The CPU refuses device memory. One object is for one thread at a
/// time.
///
/// The result is a function of source, field and output alone (docs/design/definition.md): the same bits for any number
/// of threads, any split into regions and any backend.
class Resampler {
 public:
  virtual ~Resampler() = default;
  const Geometry& output() const { return output_; }

  /// Checks the field and takes its bounds. The view is kept: its vertices must stay as they are until the next call.
  /// @throws InputError for a field that is not finite (a pull field may have NaN: no source), too far away, too fine,
  ///         or that does not reach over the output
  ///         (Outside::refuse); or of the other direction than this resampler's
  virtual void set_field(const FieldView& field, const Control& control = {});
  virtual void set_field(const PullFieldView& field, const Control& control = {});

  /// The part of a source grid that `resample(output)` may read: what a streaming reader must hold.
  virtual Region source_region(const Geometry& source, Region output) const = 0;

  /// Writes `region` of every target and map. @throws InputError for views that do not fit; Cancelled
  virtual Report resample(Region region, std::span<const Target> targets, const Maps& maps = {},
                          const Control& control = {}) = 0;

 protected:
  explicit Resampler(Geometry output);

 private:
  Geometry output_;
};

struct Limits {
  int threads = 0;  ///< 0: all that this process may use
  /// Bytes on the device for fields, sources and results that are on the host; 0: what is free there, less a reserve.
  /// What does not fit is streamed in slabs. Working space comes on top: 10 % or 128 MB, whichever is more. Views of
  /// device memory do not count. The CPU keeps nothing there.
  std::uint64_t memory = 0;
};

/// Forward fields on the CPU. @throws InputError for an output with fewer than two voxels or more than 2^18 on an axis
std::unique_ptr<Resampler> make_cpu_resampler(Geometry output, Limits limits = {});
/// Pull fields on the CPU: the same Resampler, fed with PullFieldView.
std::unique_ptr<Resampler> make_cpu_pull_resampler(Geometry output, Limits limits = {});

/// The same on a CUDA device: the same bits. @throws DeviceError without a device, NotCompiled in a build without CUDA
///
/// Fields, sources and results on the host pass through pinned memory, downloads beside the kernels; repeated sizes
/// allocate nothing. `set_field` and `resample` throw DeviceError where not even one slice fits the memory allowed.
std::unique_ptr<Resampler> make_cuda_resampler(Geometry output, int device = 0, Limits limits = {});
std::unique_ptr<Resampler> make_cuda_pull_resampler(Geometry output, int device = 0, Limits limits = {});

/// One whole volume through one field, onto the resampler's geometry; the background is the smallest value present.
template <class V>
Volume<V> resample(Resampler& resampler, const Volume<V>& source, const VertexField& field, Report* report = nullptr) {
  require(!source.voxels.empty(), "the source volume is empty");
  Volume<V> output{resampler.output(), std::vector<V>(static_cast<std::size_t>(voxel_count(resampler.output())))};
  resampler.set_field(view(field));
  const V smallest = *std::min_element(source.voxels.begin(), source.voxels.end());
  const Target target{.source = view(source), .output = view(output), .background = static_cast<double>(smallest)};
  const Report result = resampler.resample(whole(output.geometry), {&target, 1});
  if (report) *report = result;
  return output;
}

}  // namespace tetwarp
