// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/fields/formula.h"
#include "deform/phantom.h"

namespace tetwarp {
namespace {

const Volume<std::int16_t>& phantom() {
  static const Volume<std::int16_t> made = make_phantom({24, 20, 16}, {9, 10, 11}, 3);
  return made;
}

TEST(Factories, TheCpuIsWhatDeformHas) {
  const VertexField field = twist(phantom().geometry, 0.4, 4);
  const auto chosen_one = make_forward_resampler(BackendKind::cpu, phantom().geometry);
  const auto plain = make_cpu_resampler(phantom().geometry);
  EXPECT_EQ(resample(*chosen_one, phantom(), field).voxels, resample(*plain, phantom(), field).voxels);
}

TEST(Factories, ADeviceThatIsNotThereIsTold) {
  if (device_count() > 0) GTEST_SKIP() << "a CUDA device works here";
  const Geometry& grid = phantom().geometry;
  const auto refuses = [](auto&& make) {
    try {
      make();
    } catch (const NotCompiled&) {
      return !has_cuda();
    } catch (const DeviceError&) {
      return has_cuda();
    }
    return false;
  };
  EXPECT_TRUE(refuses([&] { make_forward_resampler(BackendKind::cuda, grid); }));
  EXPECT_TRUE(refuses([&] { make_pull_resampler(BackendKind::cuda, grid); }));
  EXPECT_TRUE(refuses([&] { AnyResampler(BackendKind::cuda, Direction::pull, grid); }));
  EXPECT_TRUE(refuses([&] { make_renderer(BackendKind::cuda); }));
  EXPECT_TRUE(refuses([&] { DeviceStream(0); }));
  EXPECT_TRUE(refuses([&] { describe_device(0); }));
}

TEST(AnyResampler, HasTheDirectionForWhichItWasMade) {
  const Geometry& grid = phantom().geometry;
  EXPECT_FALSE(AnyResampler());
  const AnyResampler forward(BackendKind::cpu, Direction::forward, grid);
  EXPECT_TRUE(forward);
  EXPECT_EQ(forward.backend(), BackendKind::cpu);
  EXPECT_EQ(&forward.forward(), &*forward);
  EXPECT_THROW(forward.pull(), std::bad_variant_access);
  AnyResampler pull(BackendKind::cpu, Direction::pull, grid);
  EXPECT_EQ(&pull.pull(), &*pull);
  EXPECT_THROW(pull.forward(), std::bad_variant_access);
  EXPECT_EQ(pull->output(), grid);
  pull.reset();
  EXPECT_FALSE(pull);
}

}  // namespace
}  // namespace tetwarp
