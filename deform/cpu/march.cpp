// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/march.h"

// Compiled once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/march.cpp"
#include <hwy/foreach_target.h>
// After it, as Highway asks.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "deform/cpu/vector_coarse_map-inl.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

template <bool kCoarse>
class Marcher {
 public:
  Marcher(const VectorField& field, const NudgeTurns& turns, const MarchTile& tile, MarchScratch& scratch)
      : field_(field), turns_(turns), tile_(tile), scratch_(scratch), size_(tile.box.end - tile.box.begin) {}

  void run() {
    scratch_.unsettled.clear();
    seed();
    with_snapping(field_, [&](auto snapping) {
      constexpr Snapping kSnapping = decltype(snapping)::value;
      slice<kSnapping, true>(0);
      for (int k = 1; k < size_.z; ++k) slice<kSnapping, false>(k);
    });
  }

 private:
  static constexpr int kRow = static_cast<int>(kTile);
  static constexpr int kSeedTries = 40;               ///< from an undeformed guess
  static constexpr int kFirstTries = 16, kTries = 6;  ///< of voxels that failed, at the first slice and at others
  static constexpr int kWholeSteps = 3;  ///< tries; then half steps, for in folds whole ones may go round in circles

  /// Guesses for the first row: where the middle of the first slice comes from, by repeated prediction.
  void seed() {
    const StepLattice& lattice = field_.lattice;
    const glm::ivec3 middle(size_.x / 2, size_.y / 2, 0), voxel = tile_.box.begin + middle;
    const glm::vec3 place = lattice.place(glm::vec3(voxel));
    MarchScratch::Queue& queue = scratch_.queue;
    queue.count = 1;
    queue.voxel[0] = middle.x + kRow * middle.y;
    queue.x[0] = place.x;
    queue.y[0] = place.y;
    queue.z[0] = place.z;
    const int column = middle.x + kRow * middle.y;
    for (int n = 0; n < kSeedTries && queue.count != 0; ++n) again<false>(n);
    const glm::vec3 found = queue.count == 0 ? glm::vec3(scratch_.x[column], scratch_.y[column], scratch_.z[column])
                                             : glm::vec3(queue.x[0], queue.y[0], queue.z[0]);
    queue.count = 0;
    for (int i = 0; i < kRow; ++i) {
      const glm::vec3 guess = found + glm::vec3(i - middle.x, -middle.y, 0) * lattice.voxel;
      scratch_.x[i] = guess.x;
      scratch_.y[i] = guess.y;
      scratch_.z[i] = guess.z;
    }
  }

  /// @tparam kFirst  each row is predicted from the row before, the first one is given
  template <Snapping kSnapping, bool kFirst>
  void slice(int k) {
    const Floats df;
    const Ints di;
    const hn::Rebind<std::uint8_t, Floats> d8;
    const auto lanes = static_cast<int>(hn::Lanes(df));
    const PointAxis z(set(tile_.box.begin.z + k), field_, turns_, 2, kNudgeZ);
    for (int j = 0; j < size_.y; ++j) {
      const PointAxis y(set(tile_.box.begin.y + j), field_, turns_, 1, kNudgeY);
      const int first = (k * size_.y + j) * size_.x;
      for (int i = 0; i < size_.x; i += lanes) {
        const int column = kRow * j + i;
        float *const at_x = scratch_.x + column, *const at_y = scratch_.y + column, *const at_z = scratch_.z + column;
        const Vec3 place{hn::LoadU(df, at_x), hn::LoadU(df, at_y), hn::LoadU(df, at_z)};
        const auto* owners = reinterpret_cast<const std::uint8_t*>(tile_.owners) + first + i;
        const IntMask wanted = hn::And(hn::Eq(hn::PromoteTo(di, hn::LoadU(d8, owners)), set(1)),
                                       hn::FirstN(di, static_cast<std::size_t>(size_.x - i)));
        Vec3 next = place;
        if (hn::AllFalse(di, wanted)) {
          const Float step_y = set(field_.lattice.voxel.y);
          if (kFirst && j + 1 < size_.y) store(at_x + kRow, {place.x, hn::Add(place.y, step_y), place.z});
          next.z = hn::Add(place.z, set(field_.lattice.voxel.z));
        } else {
          const PointAxis x(numbers_from(tile_.box.begin.x + i), field_, turns_, 0, kNudgeX);
          const auto trials = try_tetrahedra<kSnapping, Effort::close>(field_, place, {x.steps, y.steps, z.steps},
                                                                       {x.nudge, y.nudge, z.nudge});
          prefetch(trials.t.at_d);
          IntMask owns = hn::RebindMask(di, trials.owns);
          if constexpr (kCoarse) {
            const FixedU u = coarse_u(trials);
            hn::StoreU(u.x, di, tile_.fixed[0] + first + i);
            hn::StoreU(u.y, di, tile_.fixed[1] + first + i);
            hn::StoreU(u.z, di, tile_.fixed[2] + first + i);
            owns = hn::And(owns, u.usable);
          } else {
            const Vec3 offset = to_offset(trials.moved);
            hn::StoreInterleaved3(offset.x, offset.y, offset.z, df, &tile_.offset[first + i].x);
          }
          const IntMask failed = hn::AndNot(owns, wanted);
          if (!hn::AllFalse(di, failed)) push(numbers_from(column + kRow * kRow * k), trials.place(), failed);
          if (kFirst && j + 1 < size_.y) store(at_x + kRow, trials.next_along_j());
          next = trials.next_along_k();
        }
        store(at_x, next);
      }
    }
    for (int n = 0; n < (kFirst ? kFirstTries : kTries) && scratch_.queue.count != 0; ++n) again<true>(n);
    give_up();
  }

  /// @param x  of a column in scratch_.x
  void store(float* x, const Vec3& place) {
    const Floats df;
    const auto column = x - scratch_.x;
    hn::StoreU(place.x, df, x);
    hn::StoreU(place.y, df, scratch_.y + column);
    hn::StoreU(place.z, df, scratch_.z + column);
  }

  /// Asks for vertices two slices on, near which the march will be.
  void prefetch(Int vertices) const {
    const std::int64_t last = std::int64_t{field_.lattice.slice} * (field_.lattice.cells.z + 1) - 1;
    const std::int64_t vertex = std::int64_t{hn::GetLane(vertices)} + 2 * std::int64_t{field_.lattice.slice};
    const auto* line = reinterpret_cast<const char*>(field_.displacement + std::min(vertex, last));
    constexpr int kLine = 64;
    for (int n = 0; n * kLine < static_cast<int>(hn::Lanes(Floats()) * sizeof(glm::vec3)); ++n)
      hwy::Prefetch(line + n * kLine);
  }

  void push(Int voxels, const Vec3& place, IntMask which) {
    const Floats df;
    const Ints di;
    MarchScratch::Queue& queue = scratch_.queue;
    const FloatMask of_floats = hn::RebindMask(df, which);
    // Compressed in registers: some processors are very slow to compress into memory.
    hn::StoreU(hn::Compress(place.x, of_floats), df, queue.x + queue.count);
    hn::StoreU(hn::Compress(place.y, of_floats), df, queue.y + queue.count);
    hn::StoreU(hn::Compress(place.z, of_floats), df, queue.z + queue.count);
    hn::StoreU(hn::Compress(voxels, which), di, queue.voxel + queue.count);
    queue.count += static_cast<int>(hn::CountTrue(di, which));
  }

  /// Tries all that is in the queue once more. @tparam kWrite  offsets too; otherwise only places
  template <bool kWrite>
  void again(int attempt) {
    const Floats df;
    const Ints di;
    const auto lanes = static_cast<int>(hn::Lanes(df));
    MarchScratch::Queue& queue = scratch_.queue;
    const int count = queue.count;
    queue.count = 0;
    for (int n = 0; n < count; n += lanes) {
      const Int voxels = hn::LoadU(di, queue.voxel + n);
      const Vec3 place{hn::LoadU(df, queue.x + n), hn::LoadU(df, queue.y + n), hn::LoadU(df, queue.z + n)};
      const IntMask here = hn::FirstN(di, static_cast<std::size_t>(count - n));
      const Int inside = hn::IfThenElseZero(here, voxels);
      const auto axis = [&](Int in, int which, int size) {
        return PointAxis(hn::Add(in, set(tile_.box.begin[which])), field_, turns_, which, size);
      };
      constexpr int kBits = 5;
      static_assert(kRow == 1 << kBits);
      const Int mask = set(kRow - 1);
      const PointAxis x = axis(hn::And(inside, mask), 0, kNudgeX),
                      y = axis(hn::And(hn::ShiftRight<kBits>(inside), mask), 1, kNudgeY),
                      z = axis(hn::ShiftRight<2 * kBits>(inside), 2, kNudgeZ);
      const auto trials = try_tetrahedra<Snapping::in_double, Effort::full>(field_, place, {x.steps, y.steps, z.steps},
                                                                            {x.nudge, y.nudge, z.nudge});
      IntMask owns = hn::And(hn::RebindMask(di, trials.owns), here);
      if constexpr (kCoarse && kWrite) owns = hn::And(owns, coarse_u(trials).usable);
      if (!hn::AllFalse(di, owns)) settle<kWrite>(voxels, owns, trials);
      const Vec3 whole = trials.place();
      const Float half = set(0.5f);
      push(voxels,
           attempt < kWholeSteps
               ? whole
               : Vec3{hn::Mul(hn::Add(whole.x, place.x), half), hn::Mul(hn::Add(whole.y, place.y), half),
                      hn::Mul(hn::Add(whole.z, place.z), half)},
           hn::AndNot(owns, here));
    }
  }

  template <bool kWrite>
  void settle(Int voxels, IntMask owns, const Trials& trials) {
    const Floats df;
    const Ints di;
    alignas(64) std::int32_t voxel[MarchScratch::kRoom], owned[MarchScratch::kRoom], fixed[3][MarchScratch::kRoom];
    alignas(64) float offset[3 * MarchScratch::kRoom], next[3 * MarchScratch::kRoom];
    hn::Store(voxels, di, voxel);
    hn::Store(hn::IfThenElseZero(owns, set(1)), di, owned);
    if constexpr (kCoarse && kWrite) {
      const FixedU u = coarse_u(trials);
      hn::Store(u.x, di, fixed[0]);
      hn::Store(u.y, di, fixed[1]);
      hn::Store(u.z, di, fixed[2]);
    }
    const Vec3 u = to_offset(trials.moved), place = kWrite ? trials.next_along_k() : trials.place();
    hn::StoreInterleaved3(u.x, u.y, u.z, df, offset);
    hn::StoreInterleaved3(place.x, place.y, place.z, df, next);
    for (int n = 0; n < static_cast<int>(hn::Lanes(df)); ++n) {
      if (owned[n] == 0) continue;
      const int column = voxel[n] % (kRow * kRow), k = voxel[n] / (kRow * kRow);
      scratch_.x[column] = next[3 * n];
      scratch_.y[column] = next[3 * n + 1];
      scratch_.z[column] = next[3 * n + 2];
      if (!kWrite) continue;
      const int to = (k * size_.y + column / kRow) * size_.x + column % kRow;
      if constexpr (kCoarse) {
        for (int axis = 0; axis < 3; ++axis) tile_.fixed[axis][to] = fixed[axis][n];
      } else {
        tile_.offset[to] = {offset[3 * n], offset[3 * n + 1], offset[3 * n + 2]};
      }
    }
  }

  void give_up() {
    MarchScratch::Queue& queue = scratch_.queue;
    for (int n = 0; n < queue.count; ++n)
      scratch_.unsettled.push_back({queue.voxel[n], {queue.x[n], queue.y[n], queue.z[n]}});
    queue.count = 0;
  }

  const VectorField& field_;
  const NudgeTurns& turns_;
  const MarchTile& tile_;
  MarchScratch& scratch_;
  glm::ivec3 size_;
};

void march_tile(const VectorField& field, const NudgeTurns& nudge, const MarchTile& tile, MarchScratch& scratch) {
  if (tile.offset)
    Marcher<false>(field, nudge, tile, scratch).run();
  else
    Marcher<true>(field, nudge, tile, scratch).run();
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(march_tile);

void march(const VectorField& field, const NudgeTurns& nudge, const MarchTile& tile, MarchScratch& scratch) {
  HWY_DYNAMIC_DISPATCH(march_tile)(field, nudge, tile, scratch);
}

}  // namespace tetwarp::cpu

#endif
