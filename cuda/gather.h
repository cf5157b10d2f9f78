#pragma once

#include "cuda/claim.h"
#include "cuda/coverage.h"

namespace tetwarp::cuda_detail {

/// Where a gather puts what it finds: for each voxel of a box, whether a tetrahedron owns it and where it comes from.
struct OffsetSink {
  SlabBox box;
  std::uint8_t* mapped;
  glm::vec3* offset;

  /// @return whether the voxel counts as covered
  __device__ bool write(const glm::ivec3& voxel, const glm::vec3& u) const {
    const std::int64_t n = box.offset(glm::i64vec3(voxel));
    mapped[n] = 1;
    offset[n] = u;
    return true;
  }
  __device__ void nothing(const glm::ivec3& voxel) const {
    const std::int64_t n = box.offset(glm::i64vec3(voxel));
    mapped[n] = 0;
    offset[n] = glm::vec3(0);
  }
};

/// From voxels to their owners: marches along k, and predicts each owner from the last one.
///
/// Voxels that the march cannot settle in float go to a queue, and there to a walk with exact integers; voxels that may
/// have several owners, and what is left, are claimed. So every field with whole steps may take this way.
class Gather {
 public:
  struct Counters {
    unsigned long long covered;
    unsigned queued;   ///< voxels that the march left to the queue and the exact walk
    unsigned several;  ///< voxels that were claimed
  };

  /// Finds the voxels of `box`; waits for the stream.
  template <class Sink>
  Counters run(const LatticeOnDevice& lattice, const SlabBox& box, const Sink& sink, cudaStream_t stream);

  /// To be called when the field is another one.
  void forget_field() { claims_.forget_field(); }

  struct Entry {
    int voxel;  ///< offset in the box
    float x, y, z;
  };

 private:
  /// Whether so much is inverted that predictions would mostly fail: then all voxels are claimed.
  static bool is_mostly_folded(const LatticeOnDevice& lattice);
  /// Claims the voxels of a box that `several` names, or all.
  template <class Sink>
  void claim_box(const LatticeOnDevice& lattice, const SlabBox& box, const std::uint32_t* several, const Sink& sink,
                 cudaStream_t stream);
  Counters counters(cudaStream_t stream) const;

  Coverage coverage_;
  Claims claims_;
  DeviceBuffer<glm::vec3> seeds_;
  DeviceBuffer<Entry> queue_;
  DeviceBuffer<Counters> counters_;
};

}  // namespace tetwarp::cuda_detail
