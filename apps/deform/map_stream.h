// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <functional>
#include <future>
#include <memory>
#include <vector>

#include "apps/cli/output.h"
#include "deform/resampler.h"
#include "io/image_file.h"

namespace tetwarp::apps {

/// Maps of an output grid that are whole at no time: made slab by slab, each written while the next is made.
///
/// A slab is as many slices as make 2^23 voxels (32 of 512 x 512), at least 32, in whole layers of the CPU's tiles. So
/// what is held does not grow with the number of slices.
class MapStream {
 public:
  MapStream(const Geometry& grid, OutputSet& outputs) : grid_(grid), outputs_(outputs) {}

  /// Asks for a map. @param writer  of its file; null: it is for `make` alone
  void add(VolumeView Maps::*map, std::unique_ptr<ImageWriter> writer);

  /// Calls `make(slab, maps)` for slabs from the first slice to the last, which has to fill the maps; without maps, for
  /// the whole grid. Files are whole when it returns. @throws what `make` throws, and OutputSet::write
  void run(const std::function<void(const Region&, const Maps&)>& make);

  static std::int64_t slab_slices(const Geometry& grid);
  /// What a map holds. @param written  whether it goes to a file: then it is held twice
  static std::uint64_t bytes(const Geometry& grid, VolumeView Maps::*map, bool written);

 private:
  struct Map {
    VolumeView Maps::*place;
    std::unique_ptr<ImageWriter> writer;
    std::array<std::unique_ptr<std::byte[]>, 2> slabs = {};  ///< taken in turn; one alone where nothing is written
  };

  Maps maps_of(const Region& slab, std::size_t number);
  void write(const Maps& maps);

  Geometry grid_;
  OutputSet& outputs_;
  std::vector<Map> maps_;
  std::future<void> writing_;  ///< the last member: ends before what it refers to
};

/// One slab for `MapStream::run`: sources are cut to the slices that it needs, so that a device is sent no more, and
/// the progress told is that of the whole grid. @param finished  of the slab, as `Resampler::resample` has it
Report resample_slab(Resampler& resampler, const Region& slab, std::vector<Target> targets, const Maps& maps,
                     const Control& control, const PartSink& finished = {});

}  // namespace tetwarp::apps
