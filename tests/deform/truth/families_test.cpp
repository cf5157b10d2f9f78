// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "deform/cpu/distance_map.h"
#include "deform/phantom.h"
#include "deform/points.h"
#include "deform/truth/family.h"
#include "deform/truth/levels.h"
#include "deform/truth/slip_tube.h"
#include "tests/support/fields.h"

namespace tetwarp::truth {
namespace {

constexpr std::int64_t kCellSize = 4;

/// A phantom with labels, and in its left lung a lump, label 50.
const LabelledPhantom& body() {
  static const LabelledPhantom made = [] {
    LabelledPhantom phantom = make_labelled_phantom({112, 112, 80}, {3.6, 3.6, 3.75}, 1, {.noise_hu = 0});
    const Geometry& grid = phantom.labels.geometry;
    const AffineMap point = point_from_index(grid);
    for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
      const glm::dvec3 at = point(glm::dvec3(n % 112, n / 112 % 112, n / 112 / 112));
      if (glm::distance(at, glm::dvec3(80, 10, 20)) < 15) phantom.labels.voxels[static_cast<std::size_t>(n)] = 50;
    }
    return phantom;
  }();
  return made;
}

std::int64_t label(PhantomLabel which) { return static_cast<std::int64_t>(which); }

const Subject& subject() {
  static const Subject made = [] {
    const ConstVolumeView labels = view(body().labels);
    const Roles roles{{"lung", {label(PhantomLabel::lung)}},
                      {"bone", {label(PhantomLabel::bone)}},
                      {"organ", {label(PhantomLabel::stomach)}},
                      {"lump", {50}}};
    return Subject(simulate::examine(view(body().ct), &labels, kCellSize, -400), roles, body().ct.geometry);
  }();
  return made;
}

/// What becomes of the whole volume: owners of its voxels and the field's tetrahedra.
struct Outcome {
  Report report;
  std::vector<std::uint8_t> coverage;
};
Outcome outcome_of(const VertexField& field, Outside outside = Outside::background) {
  const Geometry& grid = body().ct.geometry;
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field, outside));
  Volume<std::uint8_t> coverage{grid, std::vector<std::uint8_t>(static_cast<std::size_t>(voxel_count(grid)))};
  Volume<std::uint16_t> owners{grid, std::vector<std::uint16_t>(coverage.voxels.size())};
  const Report report = resampler->resample(whole(grid), {}, {.coverage = view(coverage), .owners = view(owners)});
  return {report, std::move(coverage.voxels)};
}

glm::dvec3 moved(const PointMover& mover, glm::dvec3 point) {
  EXPECT_EQ(mover.move(point), PointStatus::moved);
  return point;
}
glm::dvec3 moved(const VertexField& field, const glm::dvec3& point) {
  return moved(PointMover(body().ct.geometry, view(field, Outside::background)), point);
}

TEST(TruthFamilies, NoneFoldsAndAllAreTheSameForAnyNumberOfThreads) {
  for (const Family& family : families()) {
    const CaseChoice choice = parse_case(family.name);
    const VertexField field = make_field(choice, subject());
    const Outcome outcome = outcome_of(field);
    EXPECT_EQ(outcome.report.inverted, 0U) << family.name;
    EXPECT_EQ(outcome.report.degenerate, 0U) << family.name;
    const VertexField again = make_field(choice, subject(), {.threads = 1});
    EXPECT_EQ(field.displacement, again.displacement) << family.name;
    EXPECT_EQ(field.mesh.displacement, again.mesh.displacement) << family.name;
    double farthest = 0;
    for (const glm::vec3& by : field.displacement) farthest = std::max(farthest, double(glm::length(by)));
    EXPECT_GT(farthest, 3) << family.name;
  }
}

TEST(TruthFamilies, ElasticKeepsTheFacesOfTheGrid) {
  const VertexField field = make_field(parse_case("elastic:amplitude=12,spacing=80"), subject());
  const Outcome outcome = outcome_of(field, Outside::refuse);
  EXPECT_EQ(outcome.report.uncovered, 0U);
  EXPECT_EQ(outcome.report.multiply_owned.value(), 0U);
  // Another seed, another field.
  EXPECT_NE(field.displacement,
            make_field(parse_case("elastic:amplitude=12,spacing=80,seed=2"), subject()).displacement);
}

TEST(TruthFamilies, ElasticKeepsFacesThatNoVertexLiesOn) {
  // 49 voxels end on a vertex of cells of 4, 48 and 46 do not.
  for (const glm::i64vec3& size : {glm::i64vec3(49, 48, 46), glm::i64vec3(46, 49, 47)}) {
    const Volume<std::int16_t> water{{.size = size, .spacing = {2, 2, 2}},
                                     std::vector<std::int16_t>(static_cast<std::size_t>(size.x * size.y * size.z), 0)};
    const Subject flat(simulate::examine(view(water), nullptr, kCellSize, -400), {}, water.geometry);
    const VertexField field = make_field(parse_case("elastic:amplitude=6,spacing=50"), flat);
    const PointMover mover(water.geometry, view(field, Outside::background));
    for (int axis = 0; axis < 3; ++axis) {
      for (const double end : {0.0, 2.0 * static_cast<double>(size[axis] - 1)}) {
        glm::dvec3 place(31, 37, 41);
        place[axis] = end;
        glm::dvec3 by = place;
        EXPECT_EQ(mover.move(by), PointStatus::moved);
        EXPECT_NEAR(by[axis], end, 1e-9) << axis;
        EXPECT_NE(by, place) << axis;
      }
    }
  }
}

TEST(TruthFamilies, ShiftAndRotationAreRigid) {
  const VertexField shift = make_field(parse_case("shift:x=3,y=-2,z=1.5"), subject());
  EXPECT_EQ(shift.displacement.front(), glm::vec3(3, -2, 1.5));
  EXPECT_EQ(shift.displacement.back(), glm::vec3(3, -2, 1.5));
  const VertexField turned = make_field(parse_case("rotation:angle=90,axis=2"), subject());
  const glm::dvec3 middle = centre(turned.lattice);  // from L towards P
  EXPECT_LT(glm::distance(moved(turned, middle + glm::dvec3(20, 0, 0)), middle + glm::dvec3(0, 20, 0)), 1e-2);
}

TEST(TruthFamilies, BreathingMovesTheDiaphragmAndNoBone) {
  const VertexField field = make_field(parse_case("breathing:amplitude=20,rise=0.25"), subject());
  const std::vector<std::uint8_t> bone = subject().vertices("bone"), table = subject().table();
  double down = 0, forward = 0;
  std::size_t held = 0;
  for (std::size_t n = 0; n < field.displacement.size(); ++n) {
    down = std::max(down, -double(field.displacement[n].z));
    forward = std::max(forward, -double(field.displacement[n].y));
    if (!bone[n] && !table[n]) continue;
    ++held;
    EXPECT_EQ(field.displacement[n], glm::vec3(0));
  }
  EXPECT_GT(held, 500U);
  EXPECT_GT(down, 14);
  EXPECT_LE(down, 20);
  EXPECT_GT(forward, 1);
  EXPECT_LE(forward, 5);
}

TEST(TruthFamilies, SlipJumpsAtTheTubeAndOpensNothing) {
  const VertexField field = make_field(parse_case("slip:amplitude=15"), subject());
  ASSERT_FALSE(field.replaced.empty());
  const Outcome outcome = outcome_of(field, Outside::rest);
  const double all = static_cast<double>(voxel_count(body().ct.geometry));
  EXPECT_LT(static_cast<double>(outcome.report.uncovered) / all, 1e-3);
  EXPECT_LT(static_cast<double>(outcome.report.multiply_owned.value()) / all, 1e-3);
  // Along a line that leaves the tube at the level of the diaphragm, what is inside goes down and what is outside
  // stays.
  const SlipTube tube(subject());
  const AffineMap index = index_from_point(subject().lattice());
  const PointMover mover(body().ct.geometry, view(field, Outside::background));
  double inside = 0, outside = 0;
  for (double x = 60; x < 180; x += 1) {
    const glm::dvec3 at(x, -20, -60);
    const double depth = tube.depth_mm(glm::dvec2(index(at)));
    const double by = moved(mover, at).z - at.z;
    if (depth > 1 && depth < 20) inside = std::min(inside, by);
    if (depth < -1) outside = std::max(outside, std::abs(by));
  }
  EXPECT_LT(inside, -5);
  EXPECT_EQ(outside, 0);
}

TEST(TruthFamilies, BandsSayHowFarASlipIs) {
  const Bands bands = slip_bands(subject(), body().ct.geometry);
  ASSERT_EQ(bands.most_mm.size(), 3U);
  EXPECT_GT(bands.most_mm[0], 14);
  EXPECT_LT(bands.most_mm[0], 21);
  EXPECT_EQ(bands.most_mm[2], bands.most_mm[0] + 20);
  const SlipTube tube(subject());
  const AffineMap index = index_from_point(subject().lattice()) * point_from_index(body().ct.geometry);
  std::array<std::size_t, 4> found{};
  for (std::size_t n = 0; n < bands.voxels.voxels.size(); n += 37) {
    const auto at = static_cast<std::int64_t>(n);
    const double distance =
        std::abs(tube.depth_mm(glm::dvec2(index(glm::dvec3(at % 112, at / 112 % 112, at / 112 / 112)))));
    const std::uint8_t band = bands.voxels.voxels[n];
    ASSERT_LE(band, 3);
    ++found[band];
    EXPECT_LT(distance, (band == 0 ? INFINITY : bands.most_mm[band - 1U]) + 1e-9);
    EXPECT_GT(distance, (band == 0 ? bands.most_mm[2] : band == 1 ? -1 : bands.most_mm[band - 2U]) - 1e-9);
  }
  for (const std::size_t count : found) EXPECT_GT(count, 100U);
  EXPECT_EQ(family_of("slip").bands, &slip_bands);
  EXPECT_EQ(family_of("breathing").bands, nullptr);
}

TEST(TruthFamilies, FlexionMovesBonesRigidly) {
  // Two bones of their own: blocks of label 3 and 4.
  Volume<std::uint8_t> labels{body().ct.geometry, std::vector<std::uint8_t>(body().ct.voxels.size())};
  const auto block = [&](std::int64_t from, std::int64_t to, std::uint8_t as) {
    for (std::int64_t k = from; k < to; ++k)
      for (std::int64_t j = 50; j < 66; ++j)
        for (std::int64_t i = 48; i < 64; ++i) labels.voxels[static_cast<std::size_t>(i + 112 * (j + 112 * k))] = as;
  };
  block(12, 28, 3);
  block(48, 64, 4);
  const ConstVolumeView seen = view(labels);
  const Subject spine(simulate::examine(view(body().ct), &seen, kCellSize, -400), {{"bone", {3, 4}}},
                      body().ct.geometry);
  const VertexField field = make_field(parse_case("flexion:angle=20"), spine);
  const AffineMap point = point_from_index(body().ct.geometry);
  const auto turned = [&](const glm::dvec3& from, const glm::dvec3& to) {
    const glm::dvec3 a = point(from), b = point(to), before = b - a, after = moved(field, b) - moved(field, a);
    EXPECT_NEAR(glm::length(after), glm::length(before), 2e-3);
    return std::acos(glm::dot(before, after) / glm::dot(before, before)) * 57.29577951308232;
  };
  const double low = turned({50, 52, 14}, {60, 62, 26}), high = turned({50, 52, 50}, {60, 62, 62});
  EXPECT_GT(high - low, 5);
  // The head goes forward.
  EXPECT_LT(moved(field, point({56, 58, 60})).y, point({56, 58, 60}).y - 3);
}

TEST(TruthFamilies, FillingAndShrinkageScaleVolumesByTheirRatio) {
  struct Case {
    const char *text, *role;
    double ratio;
  };
  for (const Case& one : {Case{"filling:ratio=2", "organ", 2}, Case{"shrinkage:ratio=0.4", "lump", 0.4}}) {
    const VertexField field = make_field(parse_case(one.text), subject());
    glm::dvec3 middle(0);
    const std::vector<glm::dvec3> places = places_of(subject().lattice(), subject().vertices(one.role));
    for (const glm::dvec3& place : places) middle += place / static_cast<double>(places.size());
    const double edge = 6;
    const glm::dvec3 origin = moved(field, middle);
    const glm::dmat3 edges(moved(field, middle + glm::dvec3(edge, 0, 0)) - origin,
                           moved(field, middle + glm::dvec3(0, edge, 0)) - origin,
                           moved(field, middle + glm::dvec3(0, 0, edge)) - origin);
    EXPECT_NEAR(glm::dot(glm::cross(edges[0], edges[1]), edges[2]) / (edge * edge * edge), one.ratio, 0.03 * one.ratio)
        << one.text;
    EXPECT_LT(glm::length(field.displacement.front()), 1e-6) << one.text;
  }
}

TEST(TruthFamilies, TextsAreTakenApart) {
  const CaseChoice choice = parse_case("elastic:amplitude=7.5,seed=3");
  EXPECT_EQ(choice.name, "elastic-amplitude-7.5-seed-3");
  EXPECT_EQ(choice.values.at("amplitude"), 7.5);
  EXPECT_EQ(choice.values.at("spacing"), 60);
  for (const char* text : {"", "wobble", "elastic:", "elastic:size=3", "elastic:amplitude", "elastic:amplitude=x",
                           "elastic:amplitude=-1", "elastic:amplitude=1,amplitude=2", "elastic:amplitude=nan",
                           "elastic:seed=1.5", "shift:x=1,", "rotation:axis=5", "elastic:amplitude=1mm"})
    EXPECT_THROW(parse_case(text), InputError) << text;
  EXPECT_EQ(usual_cases({}).size(), 7U);
  EXPECT_EQ(usual_cases(Roles{{"lung", {1}}, {"bone", {2}}}).size(), 10U);
}

TEST(TruthFamilies, WhatIsMissingIsRefused) {
  const Subject bare(simulate::examine(view(body().ct), nullptr, kCellSize, -400), {}, body().ct.geometry);
  EXPECT_THROW(make_field(parse_case("breathing"), bare), InputError);
  EXPECT_THROW(
      Subject(simulate::examine(view(body().ct), nullptr, kCellSize, -400), {{"lung", {2}}}, body().ct.geometry),
      InputError);
  const ConstVolumeView labels = view(body().labels);
  EXPECT_THROW(
      Subject(simulate::examine(view(body().ct), &labels, kCellSize, -400), {{"lung", {77}}}, body().ct.geometry),
      InputError);
  EXPECT_THROW(make_field(parse_case("elastic:amplitude=40,spacing=12"), subject()), InputError);  // folds
}

TEST(TruthDistances, AreThoseOfTheNearestMark) {
  const Geometry lattice{.size = {9, 7, 5}, .spacing = {2, 3, 5}};
  std::vector<std::uint8_t> marked(9 * 7 * 5);
  test::Random random(3);
  for (int n = 0; n < 12; ++n) marked[static_cast<std::size_t>(random.integer(0, 9 * 7 * 5 - 1))] = 1;
  const std::vector<double> found = distance_mm(lattice, marked);
  const auto place = [](std::int64_t n) { return glm::dvec3(2 * (n % 9), 3 * (n / 9 % 7), 5 * (n / 63)); };
  for (std::int64_t n = 0; n < 9 * 7 * 5; ++n) {
    double nearest = 1e9;
    for (std::int64_t m = 0; m < 9 * 7 * 5; ++m)
      if (marked[static_cast<std::size_t>(m)]) nearest = std::min(nearest, glm::distance(place(n), place(m)));
    EXPECT_NEAR(found[static_cast<std::size_t>(n)], nearest, 1e-12);
  }
  for (const double distance : distance_mm(lattice, std::vector<std::uint8_t>(9 * 7 * 5)))
    EXPECT_TRUE(std::isinf(distance));
}

}  // namespace
}  // namespace tetwarp::truth
