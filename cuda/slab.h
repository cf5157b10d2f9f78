#pragma once

#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "cuda/lattice.h"
#include "deform/resampler.h"

namespace tetwarp::cuda_detail {

/// Voxels that are worked on at a time: bounds what is kept of each voxel on the device (about 30 bytes).
constexpr std::int64_t kSlabVoxels = std::int64_t{1} << 25;

/// A box of voxels, as a kernel sees it.
struct SlabBox {
  glm::i64vec3 begin, size;

  __host__ __device__ std::int64_t count() const { return size.x * size.y * size.z; }
  __device__ glm::i64vec3 voxel(std::int64_t n) const { return begin + unravel(n, size); }
  __device__ std::int64_t offset(const glm::i64vec3& voxel) const {
    const glm::i64vec3 at = voxel - begin;
    return (at.z * size.y + at.y) * size.x + at.x;
  }
};

/// Where a kernel writes the voxels of a slab: a part of a larger volume, or a buffer of the slab's own.
template <class V>
struct Destination {
  V* voxels;  ///< of `begin`
  glm::i64vec3 begin;
  std::int64_t row, slice;

  __device__ V& at(const glm::i64vec3& voxel) const {
    return voxels[(voxel.z - begin.z) * slice + (voxel.y - begin.y) * row + (voxel.x - begin.x)];
  }
};

/// Counts of a report, on the device.
struct Counts {
  unsigned long long covered, uncovered, clamped, padded, conflicts, multiply_owned;
};

/// What the field says of each voxel of a slab: where it comes from, and what maps may want to know.
struct Mapped {
  DeviceBuffer<std::uint8_t> mapped;
  DeviceBuffer<glm::vec3> offset;
  DeviceBuffer<float> jacobian;
  DeviceBuffer<std::uint16_t> owners;
};

/// Samples voxels one by one: linear, integers that float holds, no padding, source and output on one grid. The bits of
/// `sample_voxel`.
template <class V>
struct VoxelSink {
  const V* source;  ///< of voxel (0, 0, 0), were it held; likewise `output`
  glm::ivec3 last;  ///< of the whole source grid
  int row, slice;   ///< of what is buffered
  V background;
  V* output;
  int output_row, output_slice;

  __device__ int place(const glm::ivec3& voxel) const {
    return voxel.z * output_slice + voxel.y * output_row + voxel.x;
  }
  __device__ int per_slice() const { return output_slice; }
  /// A voxel that a tetrahedron owns. @return whether it comes from inside the source
  __device__ bool write(int place, const glm::ivec3& voxel, const glm::vec3& u) const;
  /// A voxel that stays where it is.
  __device__ bool copy(int place, const glm::ivec3& voxel) const {
    output[place] = source[voxel.z * slice + voxel.y * row + voxel.x];
    return true;
  }
  __device__ void nothing(int place) const { output[place] = background; }
};

using AnyVoxelSink = std::variant<VoxelSink<std::uint8_t>, VoxelSink<std::int16_t>, VoxelSink<std::uint16_t>>;

/// Samples targets and writes maps of slabs whose Mapped is known. Knows nothing of fields.
class SlabWriter {
 public:
  /// Uploads the sources that are on the host. Targets and maps are checked. @throws DeviceError
  SlabWriter(const Geometry& output, std::span<const Target> targets, const Maps& maps, cudaStream_t stream);
  ~SlabWriter();

  bool wants_jacobian() const { return maps_.jacobian.voxels != nullptr; }
  bool wants_owners() const { return maps_.owners.voxels != nullptr; }

  void write(const SlabBox& slab, const Mapped& mapped, Counts* counts);

  /// Whether all that is wanted is one volume that a VoxelSink can sample, and no maps.
  bool is_plain() const;
  /// What writes the voxels of a slab, where `is_plain`; `finish_plain` gives them to the target.
  AnyVoxelSink plain_sink(const SlabBox& slab);
  void finish_plain(const SlabBox& slab);
  /// Gives the source slices that were read to the targets.
  void finish();

 private:
  struct DeviceTarget;

  void write_target(DeviceTarget& target, const SlabBox& slab, const Mapped& mapped, std::uint8_t* coverage,
                    Counts* counts);
  void write_maps(const SlabBox& slab, const Mapped& mapped);
  template <class V>
  Destination<V> destination(const Target& target, const SlabBox& slab);
  void copy_out(const VolumeView& view, const SlabBox& slab, const void* device);

  const Geometry& output_;
  Maps maps_;
  cudaStream_t stream_;
  std::vector<std::unique_ptr<DeviceTarget>> targets_;
  DeviceBuffer<std::uint8_t> coverage_;
  DeviceBuffer<glm::vec3> inverse_mm_;
  DeviceBuffer<std::byte> voxels_;
};

}  // namespace tetwarp::cuda_detail
