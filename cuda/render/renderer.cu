// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>

#include "cuda/factories.h"
#include "cuda/render/ray_kernels.cuh"
#include "cuda/runtime/device_buffer.h"
#include "cuda/runtime/host_copies.h"
#include "cuda/runtime/launch.cuh"
#include "cuda/runtime/pointer_check.h"
#include "deform/render/stale_patches.h"

namespace tetwarp {

namespace cuda_detail {

namespace {

/// In the renderer's copy of a volume, rows and slices begin so many bytes further in a cache line than those before
/// them. Rays that run along i read several rows and slices at once, and where all begin alike, as rows of 512 voxels
/// do, they wait for the same bank.
constexpr int kLine = 128, kRowShift = 16, kSliceRows = 5;  ///< a slice begins as far as so many rows
constexpr int kMostStride = 1 << 30;                        ///< two of them are an int

/// The least number from `least` on that is `beyond` more than a multiple of `unit`.
int at_least(int least, int beyond, int unit) { return least + ((beyond - least) % unit + unit) % unit; }

class CudaRenderer final : public Renderer {
 public:
  CudaRenderer(int device, Limits limits) : device_(device), limits_(limits) {
    const DeviceScope scope(device_);
    uploads_ = std::make_unique<Uploads>();
  }
  ~CudaRenderer() override {
    cudaSetDevice(device_);  // what it owns is given back there
  }

  void set_volume(const ConstVolumeView& volume, const Control& control) override;
  void update_volume(std::span<const Region> changed, const Control& control) override;
  void set_style(const RenderStyle& style) override {
    require_valid(style);
    style_ = style;
    table_step_ = 0;
    distances_are_stale_ = true;
    stale_.forget();
  }
  void set_tints(const Tints& tints) override;
  void render(const ViewPlane& plane, std::span<std::uint8_t> rgb, const Control& control) override;
  std::optional<glm::dvec3> pick(const ViewPlane& plane, int column, int row, const Control& control) override;

 private:
  template <class Use>
  void with_scene(const ViewPlane& plane, cudaStream_t stream, Use&& use);
  void place_copy();
  /// Reads the voxels of the volume, where it lies, into all that is made of them.
  void read_all(cudaStream_t stream);
  /// @param block_rows  `count` rows of blocks; null: all, of which there are `count`
  void copy_rows(const int* block_rows, int count, cudaStream_t stream);
  /// @param block_rows  see `copy_rows`
  void find_ranges(const int* block_rows, int count, cudaStream_t stream);
  std::size_t volume_bytes() const {
    return static_cast<std::size_t>(voxel_count(geometry_)) * size_bytes(volume_.type);
  }
  void prepare(const RayFrame& frame, double step, cudaStream_t stream);
  void find_distances(const RayFrame& frame, cudaStream_t stream);
  int block_count() const { return blocks_.x * blocks_.y * blocks_.z; }

  int device_;
  Limits limits_;
  std::unique_ptr<Uploads> uploads_;
  Geometry geometry_;
  ConstVolumeView volume_;  ///< on the device
  glm::ivec3 blocks_{0};
  RenderStyle style_;
  DeviceBuffer<std::byte> voxels_;      ///< of a volume on the host
  const std::byte* on_host_ = nullptr;  ///< where its own voxels are; null: it lies on the device
  DeviceBuffer<std::byte> copy_;
  const std::byte* read_ = nullptr;  ///< by rays: the copy, or the volume where there is no room for one
  glm::ivec3 strides_{0};            ///< of what is read
  DeviceBuffer<BlockRange> ranges_;
  DeviceBuffer<std::uint8_t> distances_, other_distances_, tint_numbers_, picture_;
  DeviceBuffer<TransferEntry> table_, tint_colours_;
  DeviceBuffer<TransferIntegral> integrals_;
  TransferIntegral lowest_, highest_;  ///< entries
  ClearValues clear_;
  DeviceBuffer<int> opaque_before_, block_rows_, patches_;
  DeviceBuffer<float> picked_;
  const std::uint8_t* tints_ = nullptr;
  double table_step_ = 0;  ///< mm, that the tables are for
  bool distances_are_stale_ = true;
  StalePatches stale_{kPatchWidth, kPatchHeight};  ///< of `picture_`
};

/// Makes room for the copy, where there is any, and decides what rays read.
void CudaRenderer::place_copy() {
  const glm::ivec3 size(geometry_.size);
  const int bytes = static_cast<int>(size_bytes(volume_.type));
  const int row = at_least(size.x, kRowShift / bytes, kLine / bytes),
            rows = at_least(size.y, kSliceRows, kLine / kRowShift);
  const std::int64_t slice = std::int64_t{row} * rows;
  const auto all = static_cast<std::size_t>(slice * size.z * bytes);
  read_ = volume_.voxels;
  strides_ = {1, size.x, size.x * size.y};
  if (slice > kMostStride || (limits_.memory != 0 && all > limits_.memory)) return;
  try {
    copy_.reserve(all);
  } catch (const DeviceMemoryError&) {
    return;
  }
  read_ = copy_.data();
  strides_ = {1, row, static_cast<int>(slice)};
}

void CudaRenderer::copy_rows(const int* block_rows, int count, cudaStream_t stream) {
  if (read_ == volume_.voxels) return;
  const glm::ivec3 size(geometry_.size);
  const int bytes = static_cast<int>(size_bytes(volume_.type));
  const auto copy = [&](auto word) {
    using Word = decltype(word);
    const auto words = [&](int voxels) { return voxels * bytes / static_cast<int>(sizeof(Word)); };
    copy_kernel<<<static_cast<unsigned>(count), dim3(kCopyWidth, kCopyRows), 0, stream>>>(
        reinterpret_cast<const Word*>(volume_.voxels), words(size.x), size.y, size.z, block_rows, blocks_.y,
        reinterpret_cast<Word*>(copy_.data()), words(strides_.y), strides_.z / strides_.y);
  };
  const bool in_quads = size.x * bytes % static_cast<int>(sizeof(uint4)) == 0 &&
                        reinterpret_cast<std::uintptr_t>(volume_.voxels) % sizeof(uint4) == 0;
  if (in_quads) {
    copy(uint4{});
  } else {
    dispatch(volume_.type, copy);
  }
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void CudaRenderer::find_ranges(const int* block_rows, int count, cudaStream_t stream) {
  const int parts = (blocks_.x + kRangeBlocks - 1) / kRangeBlocks, row = (blocks_.x + parts - 1) / parts;
  const dim3 grid(static_cast<unsigned>(parts), static_cast<unsigned>(count));
  dispatch(volume_.type, [&](auto voxel) {
    using V = decltype(voxel);
    range_kernel<<<grid, kRangeThreads, 0, stream>>>(reinterpret_cast<const V*>(volume_.voxels),
                                                     glm::ivec3(geometry_.size), blocks_, row, block_rows,
                                                     ranges_.data());
  });
  TETWARP_CUDA_TRY(cudaGetLastError());
  distances_are_stale_ = true;
}

void CudaRenderer::update_volume(std::span<const Region> changed, const Control& control) {
  require(volume_.voxels != nullptr, "no volume is set that could have changed: call set_volume first");
  const std::vector<int> rows = block_rows_of(geometry_, changed);
  if (rows.empty()) return;
  const DeviceScope scope(device_);
  const auto stream = static_cast<cudaStream_t>(control.stream);
  const auto count = static_cast<int>(rows.size());
  if (on_host_ || count > blocks_.y * blocks_.z / 2) {
    read_all(stream);
  } else {
    block_rows_.reserve(static_cast<std::size_t>(blocks_.y) * static_cast<std::size_t>(blocks_.z));  // once
    block_rows_.upload(rows.data(), rows.size(), stream);
    copy_rows(block_rows_.data(), count, stream);
    find_ranges(block_rows_.data(), count, stream);
  }
  stale_.change(geometry_, changed);  // while the device is at work
}

void CudaRenderer::set_volume(const ConstVolumeView& volume, const Control& control) {
  require_renderable(volume);
  const DeviceScope scope(device_);
  require_memory(volume.voxels, volume.memory, "the volume");
  geometry_ = *volume.geometry;
  volume_ = volume;
  volume_.geometry = &geometry_;
  on_host_ = volume.memory == Memory::host ? volume.voxels : nullptr;
  if (on_host_) volume_.voxels = voxels_.reserve(volume_bytes());
  blocks_ = ray_blocks(geometry_);
  ranges_.reserve(static_cast<std::size_t>(block_count()));
  place_copy();
  read_all(static_cast<cudaStream_t>(control.stream));
  tints_ = nullptr;
  stale_.forget();
}

void CudaRenderer::read_all(cudaStream_t stream) {
  if (on_host_) uploads_->copy(voxels_.data(), on_host_, volume_bytes(), stream);
  const int rows = blocks_.y * blocks_.z;
  copy_rows(nullptr, rows, stream);
  find_ranges(nullptr, rows, stream);
  if (on_host_) TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
}

void CudaRenderer::set_tints(const Tints& tints) {
  require_valid(tints, volume_);
  tints_ = nullptr;
  stale_.forget();
  if (!tints.numbers.voxels) return;
  const DeviceScope scope(device_);
  require_memory(tints.numbers.voxels, tints.numbers.memory, "the tints");
  tints_ = reinterpret_cast<const std::uint8_t*>(tints.numbers.voxels);
  if (tints.numbers.memory == Memory::host) {
    const auto count = static_cast<std::size_t>(voxel_count(geometry_));
    uploads_->copy(reinterpret_cast<std::byte*>(tint_numbers_.reserve(count)), tints.numbers.voxels, count, nullptr);
    TETWARP_CUDA_TRY(cudaStreamSynchronize(nullptr));
    tints_ = tint_numbers_.data();
  }
  const std::vector<TransferEntry> colours = tint_table(tints);
  tint_colours_.upload(colours.data(), colours.size(), nullptr);
}

void CudaRenderer::find_distances(const RayFrame& frame, cudaStream_t stream) {
  const unsigned launches = blocks_for(block_count(), kDistanceThreads);
  const auto count = static_cast<std::size_t>(block_count());
  std::uint8_t *from = distances_.reserve(count), *to = other_distances_.reserve(count);
  empty_kernel<<<launches, kDistanceThreads, 0, stream>>>(ranges_.data(), block_count(), frame, opaque_before_.data(),
                                                          to);
  spread_kernel<<<launches, kDistanceThreads, 0, stream>>>(to, blocks_, 0, from);
  spread_kernel<<<launches, kDistanceThreads, 0, stream>>>(from, blocks_, 1, to);
  spread_kernel<<<launches, kDistanceThreads, 0, stream>>>(to, blocks_, 2, from);
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void CudaRenderer::prepare(const RayFrame& frame, double step, cudaStream_t stream) {
  if (step != table_step_) {
    const std::vector<TransferEntry> table = transfer_table(style_.transfer, step);
    const TransferIntegrals made = transfer_integrals(table, step);
    lowest_ = made.lowest;
    highest_ = made.highest;
    clear_ = clear_values(table, frame);
    table_.upload(table.data(), table.size(), stream);
    const std::vector<int> before = opaque_before(table);
    opaque_before_.upload(before.data(), before.size(), stream);
    integrals_.upload(made.before.data(), made.before.size(), stream);
    table_step_ = step;
  }
  if (distances_are_stale_) find_distances(frame, stream);
  distances_are_stale_ = false;
}

/// Calls `use` with what rays of a picture see.
template <class Use>
void CudaRenderer::with_scene(const ViewPlane& plane, cudaStream_t stream, Use&& use) {
  const RayFrame frame = ray_frame(geometry_, style_, plane);
  prepare(frame, step_mm(geometry_, style_, plane), stream);
  const RayTables tables{ranges_.data(), distances_.data(), blocks_, table_.data(), integrals_.data(),
                         lowest_,        highest_,          clear_,  tints_,        tint_colours_.data()};
  dispatch(volume_.type, [&](auto voxel) {
    using V = decltype(voxel);
    use(RayScene<V>{frame, tables, {reinterpret_cast<const V*>(read_), glm::ivec3(geometry_.size), strides_}});
  });
  TETWARP_CUDA_TRY(cudaGetLastError());
}

void CudaRenderer::render(const ViewPlane& plane, std::span<std::uint8_t> rgb, const Control& control) {
  require_ready(volume_, style_, plane, rgb.size());
  if (control.stop.stop_requested()) throw Cancelled();
  const DeviceScope scope(device_);
  const auto stream = static_cast<cudaStream_t>(control.stream);
  cudaPointerAttributes found{};
  TETWARP_CUDA_TRY(cudaPointerGetAttributes(&found, rgb.data()));
  const bool on_device = found.type == cudaMemoryTypeDevice || found.type == cudaMemoryTypeManaged;
  const std::optional<std::vector<int>> patches = stale_.take(plane);
  const bool is_kept = stale_.is_worth_keeping();
  std::uint8_t* const pixels = on_device && !is_kept ? rgb.data() : picture_.reserve(rgb.size());
  const unsigned all = blocks_for(plane.width, kPatchWidth) * blocks_for(plane.height, kPatchHeight),
                 count = patches ? static_cast<unsigned>(patches->size()) : all;
  if (count > 0) {
    if (patches) {
      patches_.reserve(all);  // once, for the device waits for a larger array
      patches_.upload(patches->data(), patches->size(), stream);
    }
    with_scene(plane, stream, [&](const auto& scene) {
      ray_kernel<<<blocks_for(count, kPatches), kPatches * 32, 0, stream>>>(
          scene, plane.width, plane.height, patches ? patches_.data() : nullptr, static_cast<int>(count), pixels);
    });
  }
  if (pixels != rgb.data())
    TETWARP_CUDA_TRY(cudaMemcpyAsync(rgb.data(), pixels, rgb.size(), cudaMemcpyDefault, stream));
  TETWARP_CUDA_TRY(cudaStreamSynchronize(stream));
  if (is_kept) stale_.keep(plane);
}

std::optional<glm::dvec3> CudaRenderer::pick(const ViewPlane& plane, int column, int row, const Control& control) {
  require_pixel(volume_, style_, plane, column, row);
  const DeviceScope scope(device_);
  const auto stream = static_cast<cudaStream_t>(control.stream);
  float* const found = picked_.reserve(4);
  with_scene(plane, stream, [&](const auto& scene) { pick_kernel<<<1, 1, 0, stream>>>(scene, column, row, found); });
  glm::vec4 index;
  picked_.download(&index.x, 4, stream);
  if (index.w == 0) return std::nullopt;
  return point_from_index(geometry_)(glm::dvec3(index));
}

}  // namespace

}  // namespace cuda_detail

std::unique_ptr<Renderer> make_cuda_renderer(int device, const Limits& limits) {
  return std::make_unique<cuda_detail::CudaRenderer>(device, limits);
}

}  // namespace tetwarp
