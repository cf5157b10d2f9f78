// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Fields, volumes and maps in device memory: the bits of host memory, and refusals instead of a lost context.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include "backend/devices.h"
#include "backend/factories.h"
#include "tests/cuda/on_device.h"
#include "tests/support/fields.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

class DeviceMemory : public testing::Test {
 protected:
  void SetUp() override {
    if (device_count() == 0) GTEST_SKIP() << "no CUDA device";
  }
};

/// A field with folds, and a source on another grid.
struct Scene {
  Random random;
  Geometry grid = unit_grid({41, 30, 23});
  VertexField field;
  Volume<std::int16_t> source;

  explicit Scene(std::uint64_t stream) : random(test_seed(), stream), source{grid, {}} {
    field = field_in_voxels(grid, lattice_over(grid, random.integer(1, 4)), [&](const glm::dvec3&) {
      return 2.0 * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    });
    source.voxels.resize(static_cast<std::size_t>(voxel_count(grid)));
    for (std::int16_t& voxel : source.voxels) voxel = static_cast<std::int16_t>(random.integer(-1000, 3000));
  }
};

TEST_F(DeviceMemory, GivesTheBitsOfHostMemoryOnAnyStream) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < 6; ++n) {
    Scene scene(n);
    const Region region{{1, 2, 3}, {40, 29, 22}};
    const auto cpu = make_cpu_resampler(scene.grid);
    cpu->set_field(view(scene.field));
    auto expected = poisoned<std::int16_t>(scene.grid);
    auto maps = poisoned_outcome<std::int16_t>(scene.grid);
    const Target host_target{.source = view(scene.source), .output = view(expected), .background = -7};
    const Report expected_report = cpu->resample(region, {&host_target, 1}, maps_of(maps));

    const OnDevice displacement(scene.field.displacement);
    const OnDevice source(scene.source.voxels);
    const OnDevice output(poisoned<std::int16_t>(scene.grid).voxels);
    const auto fresh = poisoned_outcome<std::int16_t>(scene.grid);
    const OnDevice coverage(fresh.coverage.voxels);
    const OnDevice inverse(fresh.inverse_mm.voxels);
    const OnDevice jacobian(fresh.jacobian.voxels);
    const OnDevice owners(fresh.owners.voxels);
    cudaStream_t stream = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), cudaSuccess);
    const Control control{.stream = n % 2 == 0 ? stream : nullptr};
    const auto cuda = make_forward_resampler(BackendKind::cuda, scene.grid);
    FieldView field = view(scene.field);
    field.displacement = displacement.data();
    field.memory = Memory::device;
    cuda->set_field(field, {}, control);
    const Target target{.source = on_device(host_target.source, source.data()),
                        .output = on_device(host_target.output, output.data()),
                        .background = -7};
    const Maps host_maps = maps_of(maps);
    const Maps device_maps{on_device(host_maps.coverage, coverage.data()),
                           on_device(host_maps.inverse_mm, inverse.data()),
                           on_device(host_maps.jacobian, jacobian.data()), on_device(host_maps.owners, owners.data())};
    const Report report = cuda->resample(region, {&target, 1}, device_maps, control);
    EXPECT_EQ(cudaStreamDestroy(stream), cudaSuccess);

    EXPECT_TRUE(same_bits(expected.voxels, output.download()));
    EXPECT_TRUE(same_bits(maps.coverage.voxels, coverage.download()));
    EXPECT_TRUE(same_bits(maps.inverse_mm.voxels, inverse.download()));
    EXPECT_TRUE(same_bits(maps.jacobian.voxels, jacobian.download()));
    EXPECT_TRUE(same_bits(maps.owners.voxels, owners.download()));
    EXPECT_EQ(report.covered, expected_report.covered);
    EXPECT_EQ(report.multiply_owned, expected_report.multiply_owned);
  }
}

TEST_F(DeviceMemory, GradientsToo) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < 6; ++n) {
    Scene scene(300 + n);
    Volume<float> source{scene.grid, {}}, given = poisoned<float>(scene.grid), gradient = given;
    for (const std::int16_t voxel : scene.source.voxels) source.voxels.push_back(voxel);
    for (float& value : given.voxels) value = static_cast<float>(scene.random.real(-1, 1));
    std::vector<glm::vec3> moved(scene.field.displacement.size());
    const auto cpu = make_cpu_adjoint(scene.grid);
    cpu->set_field(view(scene.field));
    const AdjointTarget host{.source = view(source), .output_gradient = view(given), .source_gradient = view(gradient)};
    cpu->apply({&host, 1}, {moved});

    const OnDevice displacement(scene.field.displacement), to_vertices(std::vector<glm::vec3>(moved.size()));
    const OnDevice from(source.voxels), of_output(given.voxels), of_source(poisoned<float>(scene.grid).voxels);
    cudaStream_t stream = nullptr;
    ASSERT_EQ(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), cudaSuccess);
    const Control control{.stream = n % 2 == 0 ? stream : nullptr};
    FieldView field = view(scene.field);
    field.displacement = displacement.data();
    field.memory = Memory::device;
    const auto cuda = make_adjoint(BackendKind::cuda, scene.grid);
    cuda->set_field(field, control);
    const AdjointTarget target{.source = on_device(host.source, from.data()),
                               .output_gradient = on_device(host.output_gradient, of_output.data()),
                               .source_gradient = on_device(host.source_gradient, of_source.data())};
    cuda->apply({&target, 1}, {{to_vertices.data(), moved.size()}, Memory::device}, control);
    EXPECT_EQ(cudaStreamDestroy(stream), cudaSuccess);
    EXPECT_TRUE(same_bits(gradient.voxels, of_source.download()));
    EXPECT_TRUE(same_bits(moved, to_vertices.download()));

    AdjointTarget wrong = target;
    wrong.source_gradient = on_device(host.source_gradient, gradient.voxels.data());
    EXPECT_THROW(cuda->apply({&wrong, 1}, {}), InputError);
    EXPECT_THROW(cpu->apply({&target, 1}, {}), InputError);
  }
}

TEST_F(DeviceMemory, PullFieldsToo) {
  SCOPED_TRACE(seed_text(test_seed()));
  Scene scene(17);
  const PullField field{scene.field.lattice, scene.field.displacement};
  const auto cpu = make_cpu_pull_resampler(scene.grid);
  cpu->set_field(view(field));
  auto expected = poisoned<std::int16_t>(scene.grid);
  const Target host_target{.source = view(scene.source), .output = view(expected)};
  cpu->resample(whole(scene.grid), {&host_target, 1});
  const OnDevice displacement(field.displacement);
  PullFieldView device_field = view(field);
  device_field.displacement = displacement.data();
  device_field.memory = Memory::device;
  const auto cuda = make_pull_resampler(BackendKind::cuda, scene.grid);
  cuda->set_field(device_field);
  auto found = poisoned<std::int16_t>(scene.grid);
  const Target target{.source = view(scene.source), .output = view(found)};
  cuda->resample(whole(scene.grid), {&target, 1});
  EXPECT_TRUE(same_bits(expected.voxels, found.voxels));
  const Region part{{3, 4, 5}, {20, 21, 9}};
  EXPECT_EQ(cuda->source_region(scene.grid, part), cpu->source_region(scene.grid, part));
}

TEST_F(DeviceMemory, VotesAndSeveralComponentsToo) {
  SCOPED_TRACE(seed_text(test_seed()));
  Scene scene(23);
  const Region region{{1, 2, 3}, {40, 29, 22}};
  const auto cpu = make_cpu_resampler(scene.grid), cuda = make_forward_resampler(BackendKind::cuda, scene.grid);
  cpu->set_field(view(scene.field));
  cuda->set_field(view(scene.field));
  for (const int components : {1, 2, 3}) {
    const std::size_t values = scene.source.voxels.size() * static_cast<std::size_t>(components);
    std::vector<std::int16_t> source(values), expected(values, 77);
    for (std::int16_t& value : source) value = static_cast<std::int16_t>(scene.random.integer(0, 3));
    const OnDevice source_there(source), output_there(expected);
    const auto view_of = [&](auto* bytes) {
      return BasicView<std::remove_pointer_t<decltype(bytes)>>{&scene.grid, whole(scene.grid), VoxelType::i16,
                                                               components, bytes};
    };
    for (const Interpolation interpolation : kInterpolations) {
      const Target on_host{.source = view_of(std::as_bytes(std::span(source)).data()),
                           .output = view_of(std::as_writable_bytes(std::span(expected)).data()),
                           .interpolation = interpolation,
                           .background = -7};
      Target on_gpu = on_host;
      on_gpu.source = on_device(on_host.source, source_there.data());
      on_gpu.output = on_device(on_host.output, output_there.data());
      const Report report = cpu->resample(region, {&on_host, 1});
      expect_same_report(report, cuda->resample(region, {&on_gpu, 1}));
      EXPECT_TRUE(same_bits(expected, output_there.download()))
          << components << " components, interpolation " << static_cast<int>(interpolation);
    }
  }
}

TEST_F(DeviceMemory, PointersThatAreNotWhereTheViewSaysAreRefused) {
  Scene scene(3);
  const auto cuda = make_forward_resampler(BackendKind::cuda, scene.grid);
  FieldView lying = view(scene.field);
  lying.memory = Memory::device;
  EXPECT_THROW(cuda->set_field(lying), InputError);
  const OnDevice displacement(scene.field.displacement);
  lying = view(scene.field);
  lying.displacement = displacement.data();
  EXPECT_THROW(cuda->set_field(lying), InputError);

  cuda->set_field(view(scene.field));
  auto output = poisoned<std::int16_t>(scene.grid);
  const Target good{.source = view(scene.source), .output = view(output)};
  Target bad = good;
  bad.source.memory = Memory::device;
  EXPECT_THROW(cuda->resample(whole(scene.grid), {&bad, 1}), InputError);
  bad = good;
  bad.output.memory = Memory::device;
  EXPECT_THROW(cuda->resample(whole(scene.grid), {&bad, 1}), InputError);
  EXPECT_NO_THROW(cuda->resample(whole(scene.grid), {&good, 1}));  // the context lives on
}

}  // namespace
}  // namespace tetwarp
