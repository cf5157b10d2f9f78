// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "cuda/lattice/slab.cuh"
#include "cuda/runtime/warp.cuh"
#include "deform/errors.h"

/// From places to values and maps: the kernels of `SlabWriter`. For slab.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// From which slices of a source the slices of an output were sampled.
struct DeviceSlices {
  long long *first, *last;  ///< one per output slice, widened by atomics; or null
};

/// Samples the voxels of a box whose places are known: a thread a voxel.
///
/// @tparam kScalars   whether there is one component
/// @param plan        the source, and how it is sampled  @param components  of a voxel
/// @param slab        the box
/// @param mapped      where each voxel of the box comes from, in their order
/// @param output      written
/// @param coverage    for each voxel, written: whether it comes from inside the source; or null
/// @param slices      widened, or null  @param counts  added to; or null
template <class V, Interpolation kInterpolation, bool kScalars>
__global__ void sample_kernel(SamplePlan<V> plan, int components, SlabBox slab, MappedVoxels mapped,
                              Destination<V> output, std::uint8_t* coverage, DeviceSlices slices, Counts* counts) {
  const std::int64_t n = thread_of_grid();
  if (n >= slab.count()) return;
  const glm::i64vec3 at = slab.voxel(n);
  SampledVoxel<V> voxel;
  Place place;
  const bool inside = mapped.source_place(plan, at, n, place);
  if constexpr (kScalars) {
    voxel = sample_at<V, kInterpolation>(plan, inside, place, mapped.rounding());
    output.voxels[output.index(at)] = voxel.value;
  } else {
    voxel = sample_components_at<V, kInterpolation>(plan, components, inside, place, mapped.rounding(),
                                                    output.voxels + output.index(at) * components);
  }
  if (coverage) coverage[n] = voxel.inside;
  if (counts) {
    warp_count(&counts->covered, voxel.inside);
    warp_count(&counts->uncovered, !voxel.inside);
    warp_count(&counts->clamped, voxel.saturated);
    warp_count(&counts->padded, voxel.padded);
  }
  if (slices.first && voxel.inside) {
    if (voxel.first_slice < slices.first[at.z]) atomicMin(&slices.first[at.z], voxel.first_slice);
    if (voxel.last_slice > slices.last[at.z]) atomicMax(&slices.last[at.z], voxel.last_slice);
  }
}

/// Where there is no target, the field alone says what is covered. A thread a voxel; parameters as of `sample_kernel`.
__global__ void count_kernel(SlabBox slab, const std::uint8_t* mapped, std::uint8_t* coverage, Counts* counts) {
  const std::int64_t n = thread_of_grid();
  if (n >= slab.count()) return;
  if (coverage) coverage[n] = mapped[n];
  warp_count(&counts->covered, mapped[n] != 0);
  warp_count(&counts->uncovered, mapped[n] == 0);
}

/// Where each voxel of a box comes from, in mm: a thread a voxel.
///
/// @param mm_from_index    directions of the output times its spacing
/// @param mapped           as of `sample_kernel`
/// @param inverse_mm       for each voxel of the box: undeformed minus deformed place, LPS mm, NaN where it comes from
///                         nowhere; written
__global__ void inverse_kernel(SlabBox slab, glm::dmat3 mm_from_index, MappedVoxels mapped, glm::vec3* inverse_mm) {
  const std::int64_t n = thread_of_grid();
  if (n >= slab.count()) return;
  inverse_mm[n] =
      mapped.mapped[n] ? glm::vec3(mm_from_index * mapped.in_double(n)) : glm::vec3(__int_as_float(0x7fc00000));
}

template <class V, Interpolation kInterpolation, class... Arguments>
void launch_sample(cudaStream_t stream, std::int64_t voxels, const SamplePlan<V>& plan, int components,
                   Arguments... arguments) {
  const unsigned blocks = blocks_for(voxels);
  if (components == 1) {
    sample_kernel<V, kInterpolation, true><<<blocks, kThreads, 0, stream>>>(plan, components, arguments...);
  } else {
    sample_kernel<V, kInterpolation, false><<<blocks, kThreads, 0, stream>>>(plan, components, arguments...);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

template <class V, class... Arguments>
void launch_sample(cudaStream_t stream, Interpolation interpolation, Arguments... arguments) {
  switch (interpolation) {
    case Interpolation::nearest: return launch_sample<V, Interpolation::nearest>(stream, arguments...);
    case Interpolation::linear: return launch_sample<V, Interpolation::linear>(stream, arguments...);
    case Interpolation::cubic: return launch_sample<V, Interpolation::cubic>(stream, arguments...);
    case Interpolation::vote: return launch_sample<V, Interpolation::vote>(stream, arguments...);
  }
  throw InputError("unknown interpolation " + std::to_string(static_cast<int>(interpolation)));
}

}  // namespace

}  // namespace tetwarp::cuda_detail
