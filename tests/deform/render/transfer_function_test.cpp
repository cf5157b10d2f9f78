// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/transfer_function.h"

#include <gtest/gtest.h>

#include "deform/errors.h"
#include "deform/render/ray_frame.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

TransferFunction ramp() { return {.name = "ramp", .points = {{0, {1, 0, 0}, 0}, {100, {0, 0, 1}, 0.5}}}; }

TEST(TransferFunctions, AllNamesAreKnownAndValid) {
  EXPECT_EQ(transfer_function_names(),
            (std::vector<std::string>{"ct-bone", "ct-skin", "ct-lung", "ct-vessel", "mip", "xray"}));
  for (const std::string& name : transfer_function_names()) {
    EXPECT_EQ(transfer_function(name).name, name);
    EXPECT_NO_THROW(require_valid(transfer_function(name)));
  }
  EXPECT_THROW(transfer_function("bone"), InputError);
}

TEST(TransferFunctions, AirIsNeverSeenAndWhatEachIsNamedForIs) {
  const auto opacity = [](const std::string& name, double hu) {
    const TransferFunction transfer = transfer_function(name);
    const double low = transfer.points.front().value, high = transfer.points.back().value;
    const auto entry =
        static_cast<std::size_t>(std::clamp((hu - low) / (high - low), 0.0, 1.0) * (kTransferEntries - 1));
    return transfer_table(transfer, 1)[entry].opacity;
  };
  for (const char* name : {"ct-bone", "ct-skin", "ct-lung", "ct-vessel", "xray"}) EXPECT_EQ(opacity(name, -1000), 0);
  EXPECT_GT(opacity("ct-bone", 700), 0.3f);
  EXPECT_EQ(opacity("ct-bone", 60), 0);
  EXPECT_GT(opacity("ct-skin", 20), 0.5f);
  EXPECT_GT(opacity("ct-lung", -800), 0.01f);
  EXPECT_EQ(opacity("ct-lung", -200), 0);
  EXPECT_GT(opacity("ct-vessel", 320), 0.2f);
}

TEST(TransferFunctions, TableIsLinearBetweenPoints) {
  const std::vector<TransferEntry> table = transfer_table(ramp(), 1);
  ASSERT_EQ(table.size(), static_cast<std::size_t>(kTransferEntries));
  for (const int n : {0, 1000, 2048, kTransferEntries - 1}) {
    const double share = static_cast<double>(n) / (kTransferEntries - 1);
    const TransferEntry& entry = table[static_cast<std::size_t>(n)];
    EXPECT_NEAR(entry.red, 1 - share, 1e-6);
    EXPECT_EQ(entry.green, 0);
    EXPECT_NEAR(entry.blue, share, 1e-6);
    EXPECT_NEAR(entry.opacity, 0.5 * share, 1e-6);
  }
}

TEST(TransferFunctions, IntegralsAddUpOpticalDepthInProportionToTheStep) {
  const std::vector<TransferIntegral> one = transfer_integrals(transfer_table(ramp(), 1), 1).before,
                                      half = transfer_integrals(transfer_table(ramp(), 0.5), 0.5).before;
  ASSERT_EQ(one.size(), static_cast<std::size_t>(kTransferEntries) + 1);
  EXPECT_EQ(one.front().depth, 0);
  // The integral of -ln(1 - a) for a from 0 to 1/2: (1 - ln 2) / 2.
  EXPECT_NEAR(one.back().depth / kTransferEntries, (1 - std::log(2)) / 2 / 0.5, 2e-4);
  EXPECT_NEAR(half.back().depth, one.back().depth / 2, 1e-3 * one.back().depth);
}

TEST(TransferFunctions, RefusesWhatIsNone) {
  const auto refusal = [](auto&& change) -> std::string {
    TransferFunction transfer = ramp();
    change(transfer);
    try {
      require_valid(transfer);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  using T = TransferFunction;
  EXPECT_TRUE(says(refusal([](T& t) { t.points.pop_back(); }), {"ramp", "1 points"}));
  EXPECT_TRUE(says(refusal([](T& t) { t.points[1].value = 0; }), {"point 2", "rise"}));
  EXPECT_TRUE(says(refusal([](T& t) { t.points[1].value = NAN; }), {"point 2", "no number"}));
  EXPECT_TRUE(says(refusal([](T& t) { t.points[1].opacity = 1.5; }), {"point 2", "opacity"}));
  EXPECT_TRUE(says(refusal([](T& t) { t.points[0].colour.y = -1; }), {"point 1", "colour"}));
  EXPECT_TRUE(says(refusal([](T& t) { t.gradient = -1; }), {"gradient"}));
  EXPECT_TRUE(says(refusal([](T& t) { t.white = 0; }), {"white"}));
  EXPECT_EQ(refusal([](T& t) {
              t.projection = Projection::sum;
              t.points[1].opacity = 40;
            }),
            "");
}

}  // namespace
}  // namespace tetwarp
