// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/body.h"

#include <gtest/gtest.h>

#include "deform/phantom.h"

namespace tetwarp::truth {
namespace {

TEST(BodyMask, HoldsTheLungsAndNotTheTable) {
  const LabelledPhantom made = make_labelled_phantom({128, 128, 75}, {3.2, 3.2, 4}, 2);
  const simulate::Patient patient = simulate::examine(view(made.ct), nullptr, 4, -400);
  const Volume<std::uint8_t> mask = body_mask(made.ct.geometry, patient, 4);
  std::size_t lung = 0, lung_in = 0, table = 0, table_in = 0, tissue = 0, tissue_in = 0;
  for (std::size_t n = 0; n < mask.voxels.size(); ++n) {
    const auto label = static_cast<PhantomLabel>(made.labels.voxels[n]);
    const bool in = mask.voxels[n] != 0;
    if (label == PhantomLabel::lung) ++lung, lung_in += in;
    if (label == PhantomLabel::nothing && made.ct.voxels[n] > -700) ++table, table_in += in;
    if (label == PhantomLabel::liver || label == PhantomLabel::heart) ++tissue, tissue_in += in;
  }
  EXPECT_EQ(lung_in, lung);
  EXPECT_EQ(tissue_in, tissue);
  EXPECT_GT(table, 1000U);
  EXPECT_LT(static_cast<double>(table_in), 0.1 * static_cast<double>(table));
}

TEST(BodyMask, LastCellsTakeTheVoxelsThatAreLeft) {
  const Geometry grid{.size = {11, 9, 7}, .spacing = {1, 1, 1}};
  const Volume<std::int16_t> water{grid, std::vector<std::int16_t>(11 * 9 * 7, 0)};
  const simulate::Patient patient = simulate::examine(view(water), nullptr, 4, -400);
  const Volume<std::uint8_t> mask = body_mask(grid, patient, 4);
  EXPECT_EQ(mask.voxels, std::vector<std::uint8_t>(11 * 9 * 7, 1));
}

}  // namespace
}  // namespace tetwarp::truth
