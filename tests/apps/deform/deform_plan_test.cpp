// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What `deform` is asked for and what it plans, from values. Only a scenario is read from the disk.
#include "tests/apps/deform/stages.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::test;

TEST(DeformPlan, FollowsFromHeaders) {
  const DeformOptions options = options_of({"identity"});
  const DeformPlan plan = plan_deformation(request_of(options), headers_of(kGrid));
  EXPECT_EQ(plan.grid, kGrid);
  EXPECT_EQ(plan.disk.plain + plan.disk.packed, 7u * 6 * 5 * 2);
  DeformOptions with_field = options;
  with_field.write_field = "nowhere/field.mha";
  with_field.maps.coverage = "nowhere/coverage.mha";
  const DeformPlan more = plan_deformation(request_of(with_field), headers_of(kGrid));
  EXPECT_EQ(more.disk.plain, plan.disk.plain + 7 * 6 * 5 * (1 + 12));
  EXPECT_EQ(more.disk.packed, plan.disk.packed);
  EXPECT_EQ(more.bytes, plan.bytes + 7 * 6 * 5) << "a map that is whole in one slab";
}

TEST(DeformPlan, OnDiskLiesWhatIsWrittenAndEachFileAsItsNameSays) {
  constexpr std::uint64_t kVoxels = 7 * 6 * 5;
  const auto disk = [](const std::function<void(DeformOptions&)>& change) {
    DeformOptions options = options_of({"identity"});
    change(options);
    DeformHeaders headers = headers_of(kGrid);
    headers.input.series.emplace();
    const DeformRequest request = request_of(options);
    for (const AlongVolumeChoice& choice : request.volumes) {  // each read from a grid of 900 x 900 x 900
      AlongHeader& along = headers.along.volumes.emplace_back(AlongHeader{choice, {}, {}, kGrid});
      along.header.geometry.size = glm::i64vec3(900);
      along.own_grid.size = {3, 3, 3};
    }
    const DiskBytes bytes = plan_deformation(request, headers).disk;
    return std::pair(bytes.plain, bytes.packed);
  };
  using Bytes = std::pair<std::uint64_t, std::uint64_t>;
  EXPECT_EQ(disk([](DeformOptions&) {}), Bytes(0, 2 * kVoxels)) << ".nii.gz";
  EXPECT_EQ(disk([](DeformOptions& o) { o.output = "out.mha"; }), Bytes(2 * kVoxels, 0));
  EXPECT_EQ(disk([](DeformOptions& o) { o.output = "out.mha", o.compression = 3; }), Bytes(0, 2 * kVoxels));
  const auto series = [](DeformOptions& o) { o.input.path = "folder", o.output = "series"; };
  EXPECT_EQ(disk(series), Bytes(2 * kVoxels, 0));
  EXPECT_EQ(disk([&](DeformOptions& o) { series(o), o.dicom.encoding = DicomEncoding::rle; }), Bytes(0, 2 * kVoxels));
  EXPECT_EQ(disk([&](DeformOptions& o) {
              series(o), o.maps = {"c.NII.GZ", "i.mha", "j.nrrd", "f.nii.gz"}, o.write_field = "f.nii.gz";
            }),
            Bytes((2 + 12 + 4) * kVoxels, (1 + 2 + 12) * kVoxels));
  EXPECT_EQ(disk([&](DeformOptions& o) {
              series(o), o.with = {"a.mha=b.mha", "a.mha=c.nii.gz", "a.mha=d.mha:own"};
            }),
            Bytes((2 + 2) * kVoxels + 2 * 27, 2 * kVoxels))
      << "what is read lies there already";
}

TEST(DeformPlan, AFieldOfAScenarioTakesTheDiskOfItsVerticesAlone) {
  const Scratch scratch;
  write_file(scratch / "push.json",
             R"({"method": "mass-spring", "cell_size": 2, "tissues": [{"name": "all"}], "hold": [{"border": true}],
                 "move": [{"name": "hand", "by_mm": [0, 1, 0], "handle": {"at": {"mm": [14, 24, 36]}, "radius_mm": 3}}]})");
  DeformOptions options = options_of({});
  options.scenario = scratch / "push.json";
  options.output = "out.mha";
  options.write_field = "field.mha";
  const DeformPlan plan = plan_deformation(request_of(options), headers_of(kGrid));
  EXPECT_EQ(plan.disk.plain, 7u * 6 * 5 * 2 + 4 * 4 * 3 * 12) << "and nothing that the simulation holds";
}

TEST(DeformPlan, CountsWhatTheReportAndStructuresNeed) {
  DeformOptions options = options_of({"identity"});
  const std::uint64_t plain = plan_deformation(request_of(options), headers_of(kGrid)).bytes;
  DeformRequest with_structures = request_of(options);
  with_structures.structures.emplace_back();
  EXPECT_EQ(plan_deformation(with_structures, headers_of(kGrid)).bytes, plain + 7 * 6 * 5 * 12) << "an inverse";
  options.report = "nowhere/report.json";
  EXPECT_EQ(plan_deformation(request_of(options), headers_of(kGrid)).bytes, plain + 7 * 6 * 5 * 12) << "as well";
  Geometry tall = kGrid;
  tall.size.z = 1000;
  const std::uint64_t of_tall = plan_deformation(request_of(options), headers_of(tall)).bytes;
  EXPECT_EQ(of_tall - plan_deformation(request_of(options_of({"identity"})), headers_of(tall)).bytes,
            7u * 6 * 12 * RoundTrip::kMostSlices);
}

TEST(DeformPlan, CountsTheMapsThatMassNeedsOnce) {
  DeformOptions options = options_of({"identity"});
  const std::uint64_t plain = plan_deformation(request_of(options), headers_of(kGrid)).bytes;
  options.preserve_mass = true;
  const std::uint64_t mass = plan_deformation(request_of(options), headers_of(kGrid)).bytes;
  EXPECT_EQ(mass - plain, 7u * 6 * 5 * (2 * 4 + 1 + 4)) << "two volumes of floats, coverage, determinants";
  options.maps.jacobian = "nowhere/jacobian.mha";
  EXPECT_EQ(plan_deformation(request_of(options), headers_of(kGrid)).bytes, mass);
}

TEST(DeformPlan, TakesTheGridThatOptionsName) {
  DeformOptions options = options_of({"identity"});
  Geometry sheared = kGrid;
  sheared.direction[2] = glm::dvec3(0, 0.6, 0.8);
  EXPECT_EQ(plan_deformation(request_of(options), headers_of(sheared)).grid, straightened(sheared));
  options.grid = "fit";
  EXPECT_FALSE(plan_deformation(request_of(options), headers_of(kGrid)).grid.has_value());
  options.grid = "/";  // a folder that exists
  DeformHeaders headers = headers_of(kGrid);
  headers.grid = Geometry{.size = {3, 3, 3}};
  EXPECT_EQ(plan_deformation(request_of(options), headers).grid, headers.grid);
}

TEST(DeformPlan, RefusesWhatTheMemoryDoesNotHold) {
  DeformOptions options = options_of({"identity"});
  options.memory_bytes = 1000;
  const std::string said = failure<Error>([&] { plan_deformation(request_of(options), headers_of(kGrid)); });
  EXPECT_TRUE(says(said, {"of memory are needed, --memory allows"}));
  options.backend = BackendChoice::cuda;  // there it is a limit that the work keeps to
  EXPECT_NO_THROW(plan_deformation(request_of(options), headers_of(kGrid)));
}

TEST(DeformRequest, RefusesWhatDoesNotGoTogether) {
  const auto refused = [](const std::function<void(DeformOptions&)>& change) {
    DeformOptions options = options_of({"identity"});
    change(options);
    return failure<UsageError>([&] { request_of(options); });
  };
  EXPECT_EQ(refused([](DeformOptions&) {}), "");
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.labels = "l.mha"; }), {"--labels is for --scenario"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.scenario = "s.json"; }), {"--scenario makes the field"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.field.forward = {}; }), {"no field; give -f FIELD"}));
  EXPECT_TRUE(
      says(refused([](DeformOptions& o) { o.grid = "nowhere/grid.mha"; }), {"expected same, fit, or a volume"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.output = "series"; }), {"can only be derived from DICOM"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.maps.inverse = "i.dcm"; }), {"is a DICOM registration"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.with = {"a.mha"}; }), {"names no output"}));
  EXPECT_TRUE(says(refused([](DeformOptions& o) { o.points = {"a.csv=b.stl"}; }), {"--points writes the form"}));
  const auto pull = [&](const std::function<void(DeformOptions&)>& change) {
    return refused([&](DeformOptions& o) {
      o.field = {{}, {"nowhere/pull.mha"}, {}};
      change(o);
    });
  };
  EXPECT_EQ(pull([](DeformOptions&) {}), "");
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.preserve_mass = true; }), {"--preserve mass needs"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.field.cell_size = 2; }), {"--pull-field has its own grid"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.points = {"a.csv=b.csv"}; }), {"--points needs a forward field"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.maps.folds = "f.mha"; }), {"--jacobian and --folds"}));
  EXPECT_TRUE(says(pull([](DeformOptions& o) { o.grid = "fit"; }), {"--grid fit needs to know"}));
}

TEST(DeformRequest, KeepsTheOrderOfWhatGoesAlong) {
  DeformOptions options = options_of({"identity"});
  options.with = {"a.mha=b.mha:nearest", "c.mha=d.nrrd:own", "e.mha=f.mha:background=3"};
  options.points = {"a.csv=b.csv", "c.stl=d.stl:ras"};
  const DeformRequest request = request_of(options);
  ASSERT_EQ(request.volumes.size(), 3u);
  EXPECT_EQ(request.volumes[0].output, "b.mha");
  EXPECT_EQ(request.volumes[0].interpolation, Interpolation::nearest);
  EXPECT_TRUE(request.volumes[1].own && request.volumes[1].output == "d.nrrd");
  EXPECT_EQ(request.volumes[2].background, 3);
  ASSERT_EQ(request.points.size(), 2u);
  EXPECT_EQ(request.points[1].output, "d.stl");
}

TEST(DeformRequest, KnowsWhetherTheFieldPullsAndWhatIsSaidOfIt) {
  DeformOptions options = options_of({"identity"});
  EXPECT_FALSE(is_pull(request_of(options)));
  EXPECT_FALSE(reports_quality(request_of(options)));
  options.report = "nowhere/report.json";
  EXPECT_TRUE(reports_quality(request_of(options)));
  options.field = {{}, {"nowhere/pull.mha"}, {}};
  EXPECT_TRUE(is_pull(request_of(options)));
  EXPECT_FALSE(reports_quality(request_of(options)));
}

}  // namespace
