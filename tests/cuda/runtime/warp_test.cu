// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What the threads of a warp or block find together, beside loops on the host; and fields of words.
#include "cuda/runtime/warp.cuh"

#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "cuda/devices.h"
#include "cuda/runtime/device_buffer.h"
#include "tests/support/random.h"

namespace tetwarp {
namespace {

using namespace test;
using namespace cuda_detail;

constexpr int kBlock = 256, kWarps = kBlock / 32;

/// What each thread of one block gave and found.
struct Found {
  int scan[kBlock], group_scan[kBlock];
  unsigned group_sum[kBlock], rank[kBlock], transposed[kBlock];
  unsigned sum[kWarps];
  int least[kWarps], most[kWarps];
  float least_float[kWarps], most_float[kWarps];
  unsigned long long most_wide[kWarps];
  unsigned long long counted, added;
  unsigned listed;
};

constexpr int kGroup = 8;  ///< lanes of a group

__global__ void find_kernel(const int* values, Found* found) {
  __shared__ unsigned per_warp[kWarps];
  const int thread = static_cast<int>(threadIdx.x), warp = thread / 32, value = values[thread];
  const auto bits = static_cast<unsigned>(value);
  const unsigned sum = warp_sum(bits & 0xFFFF);
  const int least = warp_min(value), most = warp_max(value);
  const float least_float = warp_min(static_cast<float>(value)), most_float = warp_max(static_cast<float>(value));
  const unsigned long long most_wide = warp_max(static_cast<unsigned long long>(bits) << 20);
  if (lane_of_warp() == 0) {
    found->sum[warp] = sum;
    found->least[warp] = least;
    found->most[warp] = most;
    found->least_float[warp] = least_float;
    found->most_float[warp] = most_float;
    found->most_wide[warp] = most_wide;
  }
  found->scan[thread] = warp_scan(value % 100);
  found->group_scan[thread] = group_scan(value % 100, kGroup);
  found->group_sum[thread] = group_sum(bits & 0xFFFF, kGroup);
  found->transposed[thread] = transposed(bits, lane_of_warp());
  warp_add(&found->added, bits & 0xFF);
  if (thread % 3 != 0) warp_count(&found->counted, value % 2 == 0);
  __syncwarp();
  unsigned listed = 5;
  found->rank[thread] = rank_in_block(value > 0, lane_of_warp(), warp, per_warp, listed);
  found->listed = listed;
}

class Warp : public testing::Test {
 protected:
  void SetUp() override {
    if (cuda_device_count() == 0) GTEST_SKIP() << "no CUDA device";
    for (int& value : values_) value = static_cast<int>(random_.integer(-1000000, 1000000));
    DeviceBuffer<int> values;
    DeviceBuffer<Found> found;
    values.upload(values_.data(), values_.size(), nullptr);
    found.fill(0, 1, nullptr);
    find_kernel<<<1, kBlock>>>(values.data(), found.data());
    TETWARP_CUDA_TRY(cudaGetLastError());
    found.download(found_.data(), 1, nullptr);
  }
  const int* of_warp(int warp) const { return values_.data() + 32 * warp; }
  const Found& found() const { return found_[0]; }

  Random random_{test_seed(), 1};
  std::vector<int> values_ = std::vector<int>(kBlock);
  std::vector<Found> found_ = std::vector<Found>(1);
};

TEST_F(Warp, SumsAndExtremesAreThoseOfALoop) {
  SCOPED_TRACE(seed_text(test_seed()));
  unsigned long long added = 0, counted = 0;
  for (int n = 0; n < kBlock; ++n) {
    added += static_cast<unsigned>(values_[n]) & 0xFF;
    counted += n % 3 != 0 && values_[n] % 2 == 0;
  }
  EXPECT_EQ(found().added, added);
  EXPECT_EQ(found().counted, counted);
  for (int warp = 0; warp < kWarps; ++warp) {
    const int *begin = of_warp(warp), *end = begin + 32;
    unsigned sum = 0, widest = 0;
    for (const int* value = begin; value != end; ++value) {
      sum += static_cast<unsigned>(*value) & 0xFFFF;
      widest = std::max(widest, static_cast<unsigned>(*value));
    }
    EXPECT_EQ(found().sum[warp], sum);
    EXPECT_EQ(found().least[warp], *std::min_element(begin, end));
    EXPECT_EQ(found().most[warp], *std::max_element(begin, end));
    EXPECT_EQ(found().least_float[warp], static_cast<float>(*std::min_element(begin, end)));
    EXPECT_EQ(found().most_float[warp], static_cast<float>(*std::max_element(begin, end)));
    EXPECT_EQ(found().most_wide[warp], static_cast<unsigned long long>(widest) << 20);
  }
}

TEST_F(Warp, ScansAddWhatComesBeforeInTheWarpOrGroup) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (int n = 0; n < kBlock; ++n) {
    int scan = 0, group_scan = 0;
    unsigned group_sum = 0;
    for (int m = n / 32 * 32; m <= n; ++m) scan += values_[m] % 100;
    for (int m = n / kGroup * kGroup; m <= n; ++m) group_scan += values_[m] % 100;
    for (int m = 0; m < kGroup; ++m) group_sum += static_cast<unsigned>(values_[n / kGroup * kGroup + m]) & 0xFFFF;
    EXPECT_EQ(found().scan[n], scan) << n;
    EXPECT_EQ(found().group_scan[n], group_scan) << n;
    EXPECT_EQ(found().group_sum[n], group_sum) << n;
  }
}

TEST_F(Warp, RanksFollowTheOrderOfThreads) {
  SCOPED_TRACE(seed_text(test_seed()));
  unsigned rank = 5;
  for (int n = 0; n < kBlock; ++n) {
    if (values_[n] <= 0) continue;
    EXPECT_EQ(found().rank[n], rank++) << n;
  }
  EXPECT_EQ(found().listed, rank);
}

TEST_F(Warp, BitsAreTransposed) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (int n = 0; n < kBlock; ++n) {
    for (int bit = 0; bit < 32; ++bit) {
      const auto other = static_cast<unsigned>(of_warp(n / 32)[bit]);
      EXPECT_EQ(found().transposed[n] >> bit & 1, other >> n % 32 & 1) << n << " " << bit;
    }
  }
}

TEST(Bits, FieldsComeBackAsTheyWerePut) {
  using Low = BitField<0, 5>;
  using Middle = BitField<Low::kEnd, 11>;
  using High = BitField<Middle::kEnd, 16>;
  static_assert(High::kEnd == 32 && Low::kMost == 31 && Middle::kMost == 2047 && High::kMost == 65535);
  for (const unsigned low : {0u, 1u, 17u, Low::kMost}) {
    for (const unsigned middle : {0u, 1u, 1234u, Middle::kMost}) {
      for (const unsigned high : {0u, 1u, 54321u, High::kMost}) {
        const unsigned word = Low::put(low) | Middle::put(middle) | High::put(high);
        EXPECT_EQ(Low::get(word), low);
        EXPECT_EQ(Middle::get(word), middle);
        EXPECT_EQ(High::get(word), high);
      }
    }
  }
  EXPECT_EQ(BitNumber::of(3, 7), 3u * 32 + 7);
  EXPECT_EQ(BitNumber::Word::get(3 * 32 + 7), 3u);
  EXPECT_EQ(BitNumber::Bit::get(3 * 32 + 7), 7u);
}

}  // namespace
}  // namespace tetwarp
