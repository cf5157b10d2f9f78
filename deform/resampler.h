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
#include <utility>
#include <vector>

#include "deform/vertex_field.h"
#include "deform/volume.h"

/// Tetwarp: deforms medical volumes by fields of displacements.
namespace tetwarp {

/// How a value is made from the voxels around a place between them (docs/design/definition.md).
enum class Interpolation : std::uint8_t {
  nearest,  ///< the voxel at floor(x + 0.5)
  linear,   ///< trilinear: along x, then y, then z
  cubic,    ///< Catmull-Rom, indices clamped to the grid
  vote      ///< for label maps: the label whose linear weights sum to most; the smaller label of equal sums
};

/// Stored values from `low` to `high`, both included, are no data (DICOM Pixel Padding Value and Pixel Padding Range
/// Limit, PS3.3 C.7.5.1.1.2).
struct PaddingRange {
  double low = 0,  ///< first value of the range
      high = 0;    ///< last value of the range
};

/// First and last slice (index k) of a source from which some voxel of one output slice was interpolated. The range is
/// empty while `first` exceeds `last`.
struct SliceRange {
  std::int64_t first = INT64_MAX,  ///< index k in the source
      last = INT64_MIN;            ///< index k in the source
};

/// One volume to deform. All targets of a call share the owner and the undeformed place of each voxel.
///
/// A voxel may have several values (`components` of both views). Each is interpolated as if it were a volume of its
/// own; vectors are not rotated.
struct Target {
  ConstVolumeView source;  ///< must buffer at least `Resampler::source_region`
  /// Lies on the output grid of the resampler, has the type and components of the source, and must buffer the region
  /// that is resampled.
  VolumeView output;
  Interpolation interpolation = Interpolation::linear;  ///< how values are made between voxels of the source
  /// Value of every component where nothing maps; rounded and saturated to the voxel type.
  double background = 0;
  /// Values that are no data. A sample that touches one takes the value of its nearest voxel, so that padding is never
  /// mixed into tissue. For volumes of one component.
  std::optional<PaddingRange> padding = {};
  /// One range for each slice of the output grid, which every call widens; or empty.
  std::span<SliceRange> sampled_slices = {};
};

/// Further results on the output grid. A view without voxels is not filled.
struct Maps {
  /// Type u8: 1 where the voxel got a value from the first target's source through the field, else 0. Without targets:
  /// 1 where the field maps something there.
  VolumeView coverage = {};
  /// Type f32, 3 components, LPS mm: undeformed minus deformed point; NaN where nothing maps.
  VolumeView inverse_mm = {};
  /// Type f32: determinant of the owner's forward map, negative where it is turned inside out; NaN where nothing maps.
  VolumeView jacobian = {};
  /// Type u16: number of tetrahedra that own the voxel, saturated. More than 1 is a fold.
  VolumeView owners = {};
  /// Type u32: number of the tetrahedron that owns the voxel (docs/design/definition.md, "Five tetrahedra a cell"), the
  /// lowest where it folds; `kNoTetrahedron` where none does. For a lattice with replaced cells it is the index in
  /// `mesh_of` of the field, which leaves those cells out.
  VolumeView tetrahedra = {};
};

/// In `Maps::tetrahedra`: no tetrahedron owns the voxel.
constexpr std::uint32_t kNoTetrahedron = UINT32_MAX;

/// By which way a backend found the owners of the voxels of the region. The way does not change the result. All counts
/// are 0 for pull fields.
struct Paths {
  /// Voxels whose owner was predicted and proved in float, found by rasterising tiles, or known not to exist.
  std::uint64_t gathered = 0;
  /// Voxels for which no prediction was proved, so that the owner was sought with exact integers.
  std::uint64_t walked = 0;
  std::uint64_t claimed = 0;  ///< voxels that were tested against every tetrahedron which may own them
};

/// What happened. Counts of voxels are of the resampled region and the first target; all else describes the whole
/// field.
struct Report {
  std::uint64_t covered = 0;    ///< voxels that got a value through the field
  std::uint64_t uncovered = 0;  ///< voxels that got the background
  std::uint64_t clamped = 0;    ///< voxels of which a value did not fit the voxel type and was saturated
  /// Voxels that took the value of the nearest source voxel, because padding was among those with weight.
  std::uint64_t padded = 0;
  /// With Outside::rest: voxels outside the undeformed lattice or mesh onto which a tetrahedron was moved. 0 otherwise.
  std::uint64_t conflicts = 0;
  std::uint64_t inverted = 0;    ///< tetrahedra of the field that are turned inside out
  std::uint64_t degenerate = 0;  ///< tetrahedra of the field without volume; they own nothing
  /// Voxels with more than one owner; empty unless `Maps::owners` was filled.
  std::optional<std::uint64_t> multiply_owned = {};
  /// Smallest Jacobian determinant of the tetrahedra of the field, as `Maps::jacobian` has it; infinity if it was not
  /// computed.
  double jacobian_min = std::numeric_limits<double>::infinity();
  /// Largest Jacobian determinant of the tetrahedra of the field; minus infinity if it was not computed.
  double jacobian_max = -std::numeric_limits<double>::infinity();
  Paths paths;  ///< the only part that depends on the backend, the limits and the split into regions

  /// Adds the report of another region of the same field. The sum is the same for every split into regions.
  Report& operator+=(const Report& other);
};

/// Progress, stop and stream of one call. No part of it changes a result.
struct Control {
  /// Gets the share that is done, 0 to 1, rising; one call at a time, from any thread.
  std::function<void(double)> progress = {};
  std::stop_token stop = {};  ///< looked at between tiles; when it is set the call throws Cancelled
  /// A stream of the device, of the kind that its backend has (`DeviceStream`, backend/devices.h), or null for the
  /// device's default one. Work is queued there after what is queued already, and the call returns when it is done. The
  /// CPU ignores it.
  void* stream = nullptr;
};

/// What is found out of a forward field beside what deforming needs.
struct FieldOptions {
  /// Whether reports state `jacobian_min` and `jacobian_max`. Inverted tetrahedra are always counted.
  bool jacobian_range = true;
};

/// Takes each part of a region when `Resampler::resample` is done with it, so that it can be used while the others are
/// made. Parts are whole slices of the region, none twice, together the whole region. Outputs in host memory, and
/// `Target::sampled_slices`, have their last values there. Calls come from any thread, perhaps several at a time; what
/// one throws ends `resample`.
using PartSink = std::function<void(const Region&)>;

/// Sends volumes through a field onto one output grid. Its two children take the field, one after another:
/// ForwardResampler forward fields, PullResampler pull fields.
///
/// A resampler on a device takes fields, sources, outputs and maps in host or device memory, in any mixture. Device
/// memory must belong to its own device, and is used in place. The CPU refuses device memory. One object serves one
/// thread at a time.
///
/// The result depends on source, field and output grid alone (docs/design/definition.md): it has the same bits for any
/// number of threads, any split into regions and any backend.
class Resampler {
 public:
  /// Frees what the resampler holds; fields and volumes are not owned.
  virtual ~Resampler() = default;
  /// The output grid.
  const Geometry& output() const { return output_; }

  /// The voxels of a source grid that `resample` may read for the output region `output`. A reader that streams must
  /// hold them.
  virtual Region source_region(const Geometry& source, Region output) const = 0;

  /// Computes `region` of every target and map.
  /// @param region    part of the output grid
  /// @param targets   volumes that go through the field, if any
  /// @param maps      further results
  /// @param control   progress, stop and stream
  /// @param finished  gets the parts of the region that are done, unless empty
  /// @throws InputError for views that do not fit
  /// @throws Cancelled
  virtual Report resample(Region region, std::span<const Target> targets, const Maps& maps = {},
                          const Control& control = {}, const PartSink& finished = {}) = 0;

 protected:
  /// For implementations.
  /// @throws InputError for an output that is not valid or has uneven slices, fewer than two voxels, or more than 2^18,
  ///         on an axis
  explicit Resampler(Geometry output);

 private:
  Geometry output_;
};

/// Values from `low` to `high`, both included.
struct ValueRange {
  float low = 0,  ///< first value of the range
      high = 0;   ///< last value of the range
};

/// What `ForwardResampler::update` did.
struct Update {
  Report report;  ///< of the whole targets; of voxels that were left, as they were when they were computed
  std::vector<Region> changed;  ///< regions of the output outside which nothing was written
};

/// A resampler of forward fields.
class ForwardResampler : public Resampler {
 public:
  /// Checks a forward field and makes it ready. The view is kept: its vertices must not change until the next call.
  /// @param field    forward field
  /// @param options  what reports state of it
  /// @param control  stop and stream
  /// @throws InputError for a field that is not finite, lies too far away, is too fine, or does not reach over the
  ///         output with Outside::refuse
  virtual void set_field(const FieldView& field, const FieldOptions& options = {}, const Control& control = {}) = 0;

  /// Computes whole targets, as `resample` does, where their outputs hold what the last call of this function gave for
  /// the field before, and nobody has changed sources or outputs since. So the first call computes all voxels, and the
  /// next ones only those that the new field may change: frames of an animation. Other targets than those of the last
  /// call, and backends that keep no track, mean all voxels again. For pictures, voxels may also be left as they are
  /// where nothing is seen: no value of `seen` lies between the least and the largest of all values within three voxels
  /// of them, along each axis, neither before nor now. The picture is that of the whole volume, and the volume is not.
  /// They are computed as soon as they may be seen, or by a call that leaves none.
  /// @param targets  volumes that go through the field
  /// @param control  stop and stream
  /// @param seen     values of which a picture shows something (`seen_values`), rising; empty: no voxel is left
  /// @throws InputError and others, as `resample`
  virtual Update update(std::span<const Target> targets, const Control& control = {},
                        [[maybe_unused]] std::span<const ValueRange> seen = {}) {
    return {resample(whole(output()), targets, {}, control), {whole(output())}};
  }

 protected:
  /// For implementations. @throws InputError as the base
  explicit ForwardResampler(Geometry output) : Resampler(std::move(output)) {}
};

/// A resampler of pull fields.
class PullResampler : public Resampler {
 public:
  /// Checks a pull field and makes it ready. The view is kept: its samples must not change until the next call. A NaN
  /// among them says that there is no source.
  /// @param field    pull field
  /// @param control  stop and stream
  /// @throws InputError for a field that is infinite somewhere, lies too far away, or does not reach over the output
  ///         with Outside::refuse
  virtual void set_field(const PullFieldView& field, const Control& control = {}) = 0;

 protected:
  /// For implementations. @throws InputError as the base
  explicit PullResampler(Geometry output) : Resampler(std::move(output)) {}
};

/// How much of the machine may be used.
struct Limits {
  int threads = 0;  ///< number of CPU threads; 0: all that this process may use
  /// Bytes of device memory for copies of fields, sources and results that lie in host memory; 0: what is free there,
  /// less a reserve. What does not fit is streamed in slabs. Working space of 10 % or 128 MB, whichever is more, comes
  /// on top. Views of device memory do not count, and the CPU ignores it.
  std::uint64_t memory = 0;
};

/// A resampler of forward fields on the CPU.
/// @throws InputError for an output with fewer than two voxels, or more than 2^18, on an axis
std::unique_ptr<ForwardResampler> make_cpu_resampler(Geometry output, Limits limits = {});
/// A resampler of pull fields on the CPU.
/// @throws InputError for an output with fewer than two voxels, or more than 2^18, on an axis
std::unique_ptr<PullResampler> make_cpu_pull_resampler(Geometry output, Limits limits = {});

/// Deforms one whole volume by one field onto the grid of a resampler. The background is the smallest value of the
/// source.
/// @param resampler  its output grid is that of the result
/// @param source     volume in host memory
/// @param field      field that must reach over the output grid
/// @param report     gets what happened, unless null
/// @throws InputError for an empty source, or a field that does not fit
template <class V>
Volume<V> resample(ForwardResampler& resampler, const Volume<V>& source, const VertexField& field,
                   Report* report = nullptr) {
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
