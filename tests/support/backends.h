// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "deform/adjoint.h"
#include "deform/render/renderer.h"
#include "deform/resampler.h"

namespace tetwarp::test {

/// One way to run a Resampler. The contract tests are one source that runs over all of them.
struct Backend {
  template <class OneResampler>
  using Make = std::function<std::unique_ptr<OneResampler>(const Geometry& output, Limits limits)>;

  std::string name;
  std::string cannot_run;         ///< why it cannot run here; empty: it can
  Make<ForwardResampler> make;    ///< for forward fields
  Make<PullResampler> make_pull;  ///< for pull fields; null: this backend has none
  std::function<std::unique_ptr<Renderer>(Limits limits)> make_renderer;
  Make<ResampleAdjoint> make_adjoint;  ///< the transpose and the gradients

  friend void PrintTo(const Backend& backend, std::ostream* stream) { *stream << backend.name; }
};

/// Every backend of this build. A new backend is one more line in backends.cpp.
const std::vector<Backend>& backends();

/// A test that runs once for each backend, and is skipped, with the reason, for those that cannot run here.
class BackendTest : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    if (!GetParam().cannot_run.empty()) GTEST_SKIP() << GetParam().name << ": " << GetParam().cannot_run;
  }
  std::unique_ptr<ForwardResampler> make(const Geometry& output, int threads = 0) const {
    return GetParam().make(output, Limits{.threads = threads});
  }
};

inline std::string backend_name(const testing::TestParamInfo<Backend>& info) { return info.param.name; }

}  // namespace tetwarp::test

/// Defines the test suite `suite`, instantiated for every backend: write its tests with TEST_P(suite, ...).
#define TETWARP_BACKEND_SUITE(suite)                                                        \
  class suite : public ::tetwarp::test::BackendTest {};                                     \
  INSTANTIATE_TEST_SUITE_P(Backends, suite, testing::ValuesIn(::tetwarp::test::backends()), \
                           ::tetwarp::test::backend_name)
