// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What every backend of the benchmark must do; the list runs on the CPU, and on a device where there is one.
#include "bench/paper/backend.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "backend/devices.h"
#include "deform/fields/formula.h"
#include "deform/phantom.h"
#include "tests/support/run.h"

namespace tetwarp::bench {
namespace {

constexpr Method kBaselines[] = {Method::inverse4x4_double, Method::inverse3x3_double, Method::inverse3x3_float,
                                 Method::paper, Method::gascon};
constexpr Method kWithTwins[] = {Method::inverse4x4_double, Method::inverse3x3_double, Method::inverse3x3_float,
                                 Method::paper};
constexpr const char* kFields[] = {"identity",       "wave",           "twist",         "bubble",
                                   "wave-paper-1",   "wave-paper-16",  "twist-paper-1", "twist-paper-16",
                                   "bubble-paper-1", "bubble-paper-16"};
constexpr FieldSource kSources[] = {FieldSource::kernel, FieldSource::memory};
constexpr FrameCount kOneFrame{.warmup = 0, .timed = 1, .end_to_end = 1};
constexpr std::int16_t kUntouched = -32768;  // no value of the phantom

std::string backend_name(const testing::TestParamInfo<std::string>& parameter) { return parameter.param; }

std::size_t count_differing(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::size_t differing = 0;
  for (std::size_t n = 0; n < a.size(); ++n) differing += a[n] != b[n];
  return differing;
}

class BenchBackend : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    const bool on_cuda = GetParam() == "cuda";
    if (on_cuda && !has_cuda()) GTEST_SKIP() << "CUDA is not in this build";
    if (on_cuda && device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
    backend_ = on_cuda ? make_cuda_backend(0) : make_cpu_backend(0);
    volume_ = make_phantom({36, 32, 28}, {1, 1, 1}, 1);
    volume_.geometry = {.size = volume_.geometry.size};
    backend_->set_volume(volume_, kUntouched);
  }
  Formula formula(const std::string& name) const { return make_formula(name, volume_.geometry.size); }
  std::vector<std::int16_t> run(Method method, FieldSource source) {
    backend_->time(method, source, kOneFrame);
    return backend_->output();
  }
  Tally tally_of(Method method, FieldSource source) {
    backend_->time(method, source, kOneFrame);
    return compare(backend_->exact(), backend_->output(), backend_->count_writes(method, source));
  }

  // One thread: which of two writes to a voxel is the last one is then no matter of chance.
  tbb::global_control one_thread_{tbb::global_control::max_allowed_parallelism, 1};
  Volume<std::int16_t> volume_;
  std::unique_ptr<Backend> backend_;
};
INSTANTIATE_TEST_SUITE_P(Backends, BenchBackend, testing::Values(std::string("cpu"), std::string("cuda")),
                         backend_name);

TEST_P(BenchBackend, FloatFieldsAreTheProgramsFormulas) {
  for (const std::string name : kFields) {
    backend_->set_field(formula(name), 3);
    const VertexField expected = sample_on(backend_->field().lattice,
                                           parse_formula(formula_text(name, volume_.geometry.size), volume_.geometry));
    ASSERT_EQ(backend_->field().displacement.size(), expected.displacement.size());
    double largest = 0;
    for (std::size_t n = 0; n < expected.displacement.size(); ++n) {
      const glm::vec3 difference = backend_->field().displacement[n] - expected.displacement[n];
      for (int axis = 0; axis < 3; ++axis) {
        largest = std::max(largest, std::abs(static_cast<double>(difference[axis])));
      }
    }
    EXPECT_LT(largest, name.ends_with("-16") ? 5e-5 : 2e-5) << name;
  }
}

TEST_P(BenchBackend, BothFieldSourcesAreOneField) {
  for (const std::string name : kFields) {
    backend_->set_field(formula(name), 1);
    EXPECT_TRUE(test::same_bits(run(Method::tetwarp, FieldSource::kernel), run(Method::tetwarp, FieldSource::memory)));
    for (const Method method : kBaselines) {
      const std::vector<std::uint32_t> kernel = backend_->count_writes(method, FieldSource::kernel),
                                       memory = backend_->count_writes(method, FieldSource::memory);
      // On a device the two are different kernels, whose multiplications and additions may be fused differently.
      const std::size_t allowed = GetParam() == "cuda" ? kernel.size() / 1000 : 0;
      EXPECT_LE(count_differing(kernel, memory), allowed) << name << ", " << name_of(method);
      if (GetParam() == "cuda") continue;  // threads race for voxels written twice
      EXPECT_TRUE(test::same_bits(run(method, FieldSource::kernel), run(method, FieldSource::memory)))
          << name << ", " << name_of(method);
    }
  }
}

TEST_P(BenchBackend, TetwarpTimedHereIsTheCpusResult) {
  for (const std::string name : kFields) {
    backend_->set_field(formula(name), 1);
    const std::unique_ptr<ForwardResampler> resampler = make_cpu_resampler(volume_.geometry);
    Volume<std::int16_t> expected{volume_.geometry, std::vector<std::int16_t>(volume_.voxels.size())};
    const Target target{.source = view(volume_), .output = view(expected), .background = kUntouched};
    resampler->set_field(view(backend_->field()));
    resampler->resample(whole(volume_.geometry), {&target, 1});
    for (const FieldSource source : kSources) {
      EXPECT_TRUE(test::same_bits(expected.voxels, run(Method::tetwarp, source))) << name;
    }
    EXPECT_TRUE(test::same_bits(expected.voxels, backend_->exact().output)) << name;
  }
}

TEST_P(BenchBackend, CountsAreThoseOfTheTimedFrame) {
  backend_->set_field(formula("twist"), 1);
  std::vector<Method> methods(std::begin(kBaselines), std::end(kBaselines));
  for (const Method method : kWithTwins) methods.push_back(per_voxel(method));
  for (const Method method : methods) {
    for (const FieldSource source : kSources) {
      const std::vector<std::int16_t> output = run(method, source);
      const std::vector<std::uint32_t> writes = backend_->count_writes(method, source);
      std::uint64_t written = 0;
      for (std::size_t n = 0; n < output.size(); ++n) {
        ASSERT_EQ(output[n] != kUntouched, writes[n] > 0) << name_of(method) << ", voxel " << n;
        written += writes[n] > 0;
      }
      EXPECT_GT(written, output.size() / 2) << name_of(method);
    }
  }
}

TEST_P(BenchBackend, AnInversePerVoxelWritesTheSameVoxelsButForAFew) {
  backend_->set_field(formula("bubble"), 1);
  for (const Method method : kWithTwins) {
    const std::vector<std::uint32_t> a = backend_->count_writes(method, FieldSource::memory),
                                     b = backend_->count_writes(per_voxel(method), FieldSource::memory);
    EXPECT_LE(count_differing(a, b), a.size() / 20) << name_of(method);
  }
}

TEST_P(BenchBackend, IdentityLosesNoVoxelAndChangesNone) {
  backend_->set_field(formula("identity"), 1);
  for (const Method method : kBaselines) {
    const Tally tally = tally_of(method, FieldSource::memory);
    EXPECT_EQ(tally.covered, volume_.voxels.size());
    EXPECT_EQ(tally.lost, 0u) << name_of(method);
    EXPECT_EQ(tally.spilled, 0u) << name_of(method);
    EXPECT_EQ(tally.largest_difference, 0) << name_of(method);
    EXPECT_GT(tally.multiple, volume_.voxels.size() * 99 / 100) << name_of(method);
  }
}

// Wave keeps the planes along z where they are: whole slices of voxels lie on faces.
TEST_P(BenchBackend, TheClosedTestWritesVoxelsOnFacesTwiceWhereTetwarpHasOneOwner) {
  backend_->set_field(formula("wave"), 1);
  const Tally paper = tally_of(Method::paper, FieldSource::memory),
              ours = tally_of(Method::tetwarp, FieldSource::memory);
  EXPECT_GT(paper.multiple, paper.covered / 100);
  EXPECT_GT(paper.writes, paper.covered + paper.covered / 100);
  EXPECT_EQ(ours.writes, ours.covered);
  EXPECT_EQ(ours.multiple, 0u);
  EXPECT_EQ(ours.lost, 0u);
  EXPECT_EQ(ours.spilled, 0u);
  EXPECT_EQ(ours.largest_difference, 0);
}

TEST_P(BenchBackend, InterpolatingPlacesIsCloseToExactAndInterpolatingValuesIsNot) {
  backend_->set_field(formula("bubble"), 1);
  const Tally paper = tally_of(Method::paper, FieldSource::memory),
              values = tally_of(Method::inverse3x3_float, FieldSource::memory);
  EXPECT_LE(paper.largest_difference, GetParam() == "cuda" ? 16 : 1);  // a texture unit has 8 bits
  EXPECT_LT(paper.mean_difference, values.mean_difference);
  EXPECT_GT(values.largest_difference, 16);
}

TEST_P(BenchBackend, GivesTheTimesThatItHas) {
  backend_->set_field(formula("wave"), 4);
  const FrameCount frames{.warmup = 1, .timed = 3, .end_to_end = 2};
  const bool copies = GetParam() == "cuda";
  for (const Method method : {Method::paper, Method::gascon, Method::tetwarp}) {
    Samples times = backend_->time(method, FieldSource::memory, frames);
    EXPECT_EQ(times["kernel_ms"].size(), 3u);
    EXPECT_EQ(times["field_ms"].size(), method == Method::tetwarp ? 3u : 0u);
    EXPECT_EQ(times["total_ms"].size(), times["field_ms"].size());
    EXPECT_EQ(times["copy_in_ms"].size(), copies ? 2u : 0u);
    EXPECT_EQ(times["copy_out_ms"].size(), copies ? 2u : 0u);
    EXPECT_EQ(times["end_to_end_ms"].size(), copies ? 2u : 3u);
    for (const double ms : times["kernel_ms"]) EXPECT_GT(ms, 0);
  }
}

}  // namespace
}  // namespace tetwarp::bench
