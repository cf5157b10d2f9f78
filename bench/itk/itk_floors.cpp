// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk_floors.h"

namespace tetwarp::bench {

namespace {

constexpr double kStreamedMemory = 0.5;  ///< of the whole, in 16 pieces
constexpr double kSameError = 0.99;      ///< ITK's over ours: not larger, to a hundredth

std::string place_of(const ItkRun& run) {
  return itk_task(run.task).question + ", " + run.field + ", cells of " + std::to_string(run.cell_size);
}

/// Both sides sample a B-spline by the same call: its time and error are told and held against nothing. Nor is the
/// error of determinants: ours is that of the tetrahedron's map, ITK's a difference over two voxels, and the truth is
/// smooth; their time is an aim, for ours asks for the owner of each voxel first. Nor are errors with larger cells:
/// what lies between vertices is for each side to say.
void add_peer(const ItkRun& peer, const ItkRun& own, std::vector<Floor>& floors) {
  const std::string where = place_of(peer) + ", " + peer.by.filters;
  const auto unless = [](bool told, double limit) { return told ? std::nullopt : std::optional(limit); };
  const bool same_work = peer.task == kTransform, is_aim = peer.task == kDeterminant;
  const double times = peer.ms.median / own.ms.median;
  floors.push_back({"time / tetwarp's", where, times, true, unless(same_work || is_aim, 1), unless(!is_aim, 1)});
  if (!peer.deviation || !own.deviation) return;
  const bool told = same_work || is_aim || peer.cell_size > 1;
  const double ratio = peer.deviation->rms / own.deviation->rms;
  floors.push_back({"rms error / tetwarp's", where, ratio, true, unless(told, kSameError), {}});
}

const ItkStream* find_whole(const ItkResults& results, const ItkStream& like) {
  for (const ItkStream& stream : results.streams) {
    if (stream.by.method == like.by.method && stream.divisions == 1) return &stream;
  }
  return nullptr;
}

void add_stream(const ItkResults& results, const ItkStream& stream, std::vector<Floor>& floors) {
  const std::string where = stream.by.filters + ", " + std::to_string(stream.divisions) + " pieces";
  const bool own = stream.by.own;
  floors.push_back({"bytes that differ from the whole",
                    where,
                    static_cast<double>(stream.differing_bytes),
                    false,
                    own ? std::optional<double>(0) : std::nullopt,
                    {}});
  const ItkStream* whole = find_whole(results, stream);
  if (!whole || stream.divisions == 1) return;
  const bool held = own && stream.divisions >= 16;
  floors.push_back({"memory / that of the whole",
                    where,
                    static_cast<double>(stream.peak_bytes) / static_cast<double>(whole->peak_bytes),
                    false,
                    held ? std::optional(kStreamedMemory) : std::nullopt,
                    {}});
}

}  // namespace

const ItkRun* find_own(const ItkResults& results, const ItkRun& like) {
  for (const ItkRun& run : results.runs) {
    if (run.by.own && run.task == like.task && run.field == like.field && run.cell_size == like.cell_size) return &run;
  }
  return nullptr;
}

std::vector<Floor> find_floors(const ItkResults& results) {
  std::vector<Floor> floors;
  for (const ItkRun& run : results.runs) {
    const ItkRun* own = run.by.own ? nullptr : find_own(results, run);
    if (own) add_peer(run, *own, floors);
  }
  for (const ItkStream& stream : results.streams) add_stream(results, stream, floors);
  return floors;
}

}  // namespace tetwarp::bench
