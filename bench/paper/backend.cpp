// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/backend.h"

namespace tetwarp::bench {

void Backend::set_volume(const Volume<std::int16_t>& volume, std::int16_t background) {
  resampler_.reset();
  exact_.reset();
  resampler_ = make_resampler(volume.geometry);
  volume_ = &volume;
  background_ = background;
  volume_changed();
}

void Backend::set_field(const Formula& formula, std::int64_t cell_size) {
  exact_.reset();
  formula_ = formula;
  cell_size_ = cell_size;
  field_.lattice = lattice_over(volume_->geometry, cell_size);
  field_.displacement.resize(static_cast<std::size_t>(voxel_count(field_.lattice)));
  fill_field();
}

const Exact& Backend::exact() {
  if (exact_) return *exact_;
  const std::size_t voxels = volume_->voxels.size();
  Volume<std::int16_t> output{volume_->geometry, std::vector<std::int16_t>(voxels)};
  Volume<std::uint8_t> coverage{volume_->geometry, std::vector<std::uint8_t>(voxels)};
  const Target target{.source = view(*volume_), .output = view(output), .background = static_cast<double>(background_)};
  resampler_->set_field(view(field_));
  resampler_->resample(whole(volume_->geometry), {&target, 1}, {.coverage = view(coverage)});
  return exact_.emplace(std::move(output.voxels), std::move(coverage.voxels));
}

std::vector<std::uint32_t> Backend::count_writes(Method method, FieldSource source) {
  if (method != Method::tetwarp) return count_baseline_writes(method, source);
  const std::vector<std::uint8_t>& coverage = exact().coverage;
  return {coverage.begin(), coverage.end()};
}

}  // namespace tetwarp::bench
