// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Transforms and fields of other programs: options, what is refused, and damage at every byte. Where their points go is
// compared with these programs in python/tests/test_formats.py.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "io/transform_file.h"
#include "tests/support/foreign_field.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::filesystem::path kCases = TETWARP_FORMATS;

FieldSource with(const std::filesystem::path& path, const std::string& options) {
  return parse_field_source(path.string() + (options.empty() ? "" : ":" + options));
}

std::string refused_transform(const std::filesystem::path& path, const std::string& options = "") {
  return refusal([&] { read_transform_file(with(path, options)); });
}

std::string refused_field(const std::filesystem::path& path, const std::string& options = "") {
  return refusal([&] {
    FieldSource source = with(path, options);
    const FieldFileHeader header = read_field_header(source);
    if (!header.has_own_grid) {
      source.grid.emplace();
      source.grid->size = header.grid.size;
    }
    read_pull_field(source);
  });
}

/// Reads the file shortened to every length below its own: each is refused by name.
template <class Refused>
void expect_truncation_refused(const std::filesystem::path& whole, const std::string& name, Refused&& refused,
                               std::size_t step = 1) {
  const Scratch scratch;
  const std::string bytes = read_bytes(whole);
  for (std::size_t size = 0; size < bytes.size(); size += step) {
    write_file(scratch / name, bytes.substr(0, size));
    EXPECT_TRUE(says(refused(scratch / name), {"InputError", name})) << size << " of " << bytes.size();
  }
}

TEST(MatrixFile, SaysWhoseItIsOrIsRefused) {
  const Scratch scratch;
  write_file(scratch / "a.mat", "1 0 0 3\n0 1 0 5\n0 0 1 7\n0 0 0 1\n");
  EXPECT_TRUE(is_transform_file(scratch / "a.mat"));
  EXPECT_TRUE(says(refused_transform(scratch / "a.mat"), {"does not say whose it is", "tool=greedy|c3d|niftyreg"}));
  EXPECT_TRUE(says(refused_transform(scratch / "a.mat", "tool=spm"), {"tool=spm", "tool=greedy|"}));
  EXPECT_TRUE(says(refused_transform(scratch / "a.mat", "tool=flirt"), {"source=MOVING,reference=FIXED"}));
  EXPECT_TRUE(says(refused_transform(scratch / "a.mat", "tool=greedy,source=b.nii"), {"leave them out"}));
  EXPECT_TRUE(says(refused_transform(scratch / "a.mat", "tool=greedy,invert=maybe"), {"invert=maybe", "yes or no"}));
  for (const char* tool : {"greedy", "c3d", "niftyreg", "mrtrix"}) {
    const TransformFile file = read_transform_file(with(scratch / "a.mat", std::string("tool=") + tool));
    EXPECT_EQ(file.displacement(glm::dvec3(20, 30, 40)), glm::dvec3(-3, -5, 7)) << tool;
    EXPECT_EQ(file.direction, Direction::pull);
    EXPECT_EQ(file.frame, "RAS");
    const TransformFile back = read_transform_file(with(scratch / "a.mat", std::string("invert=yes,tool=") + tool));
    EXPECT_LT(glm::distance(back.displacement(glm::dvec3(20, 30, 40)), glm::dvec3(3, 5, -7)), 1e-12) << tool;
    EXPECT_FALSE(back.direction.has_value());
    EXPECT_TRUE(back.inverted && !file.inverted);
  }
}

TEST(MatrixFile, OtherTextsAreRefusedByName) {
  const Scratch scratch;
  const auto refused = [&](const std::string& text) {
    write_file(scratch / "a.mat", text);
    return refused_transform(scratch / "a.mat", "tool=greedy");
  };
  EXPECT_TRUE(says(refused("1 0 0 3\n0 1 0 5\n0 0 1 7\n"), {"12 numbers", "a.mat", "16"}));
  EXPECT_TRUE(says(refused("1 0 0 3 0 1 0 5 0 0 1 7 0 0 0 1 9"), {"\"9\"", "16 numbers"}));
  EXPECT_TRUE(says(refused("1 0 0 3 0 1 0 5 0 0 1 7 0 0 0.1 1"), {"last row"}));
  EXPECT_TRUE(says(refused("1 0 0 nan 0 1 0 5 0 0 1 7 0 0 0 1"), {"not finite"}));
  EXPECT_TRUE(says(refused("1 0 0 x 0 1 0 5 0 0 1 7 0 0 0 1"), {"\"x\""}));
  EXPECT_TRUE(says(refused("0 0 0 3 0 1 0 5 0 0 1 7 0 0 0 1"), {"without an inverse (determinant 0.0", "a.mat"}));
  EXPECT_TRUE(says(refused("1 1 0 3 1 1 1e-11 5 0 0 1 7 0 0 0 1"), {"without an inverse"})) << "but for rounding";
  EXPECT_EQ(refused("+1e-3 0 0 +3 0 +1e-3 0 5 0 0 1e-3 7 0 0 0 1"), "") << "small, with signs";
  EXPECT_TRUE(says(refused("+-1 0 0 3 0 1 0 5 0 0 1 7 0 0 0 1"), {"\"+-1\""}));
}

TEST(LtaFile, WhatIsTruncatedOrOfAnotherKindIsRefused) {
  const std::filesystem::path file = kCases / "freesurfer-lta-ras" / "affine.lta";
  const std::string text = read_bytes(file);
  // What is missing behind the last line but some digits of its last number may still be a whole file.
  const Scratch scratch;
  for (std::size_t size = 0; size + 30 < text.size(); size += 7) {
    write_file(scratch / "a.lta", text.substr(0, size));
    EXPECT_TRUE(says(refused_transform(scratch / "a.lta"), {"InputError", "a.lta"})) << size;
  }
  std::string other = text;
  other.replace(other.find("= 1"), 3, "= 14");
  write_file(scratch / "a.lta", other);
  EXPECT_TRUE(says(refused_transform(scratch / "a.lta"), {"type 14.000000", "lta_convert"}));
  EXPECT_EQ(read_transform_file(file).direction, Direction::forward);
  // Between RAS coordinates the places of the volumes are not needed; between voxels they are.
  const auto without_places = [&](const std::string& name) {
    std::string changed = read_bytes(kCases / name / "affine.lta");
    for (std::size_t at = 0; (at = changed.find("valid = 1", at)) != std::string::npos;) changed[at + 8] = '0';
    write_file(scratch / "a.lta", changed);
    return refused_transform(scratch / "a.lta");
  };
  EXPECT_EQ(without_places("freesurfer-lta-ras"), "");
  EXPECT_TRUE(says(without_places("freesurfer-lta-voxel"), {"between voxels", "not valid", "a.lta"}));
}

TEST(MgzField, TruncationAndOtherFilesAreRefused) {
  expect_truncation_refused(
      kCases / "freesurfer-disp-ras" / "warp.mgz", "warp.mgz", [](const auto& path) { return refused_field(path); },
      37);
  const Scratch scratch;
  const std::string plain = read_bytes(std::filesystem::path(TETWARP_FUZZ_CORPUS) / "mgz" / "plain.mgz");
  const auto refused = [&](std::size_t offset, const std::string& bytes) {
    std::string changed = plain;
    changed.replace(offset, bytes.size(), bytes);
    write_file(scratch / "a.mgz", changed);
    return refused_field(scratch / "a.mgz");
  };
  EXPECT_EQ(refused(0, ""), "");
  EXPECT_TRUE(says(refused(3, std::string(1, '\x02')), {"not an MGH file", "a.mgz"}));
  EXPECT_TRUE(says(refused(4, std::string("\x00\x0f\x00\x00", 4)), {"a.mgz"}));  // a size of 983040
  EXPECT_TRUE(says(refused(16, std::string("\x00\x00\x00\x01", 4)), {"no warp but 1 frames"}));
  EXPECT_TRUE(says(refused(29, std::string(1, '\0')), {"goodRASFlag 0"}));
  write_file(scratch / "a.mgz", plain.substr(0, 284 + 96 + 20));
  EXPECT_TRUE(says(refused_field(scratch / "a.mgz"), {"the form of the vectors is not stated"}));
  EXPECT_TRUE(says(refused_field(scratch / "a.mgz", "frame=ras"), {"option"}));
  EXPECT_TRUE(says(refused_field(scratch / "a.mgz", "invert=yes"), {"tetwarp invert", "a.mgz"}));
}

/// A number as MGH has it: the highest byte first.
std::string big_endian(std::int32_t value) {
  const auto bits = static_cast<std::uint32_t>(value);
  return {static_cast<char>(bits >> 24), static_cast<char>(bits >> 16), static_cast<char>(bits >> 8),
          static_cast<char>(bits)};
}

TEST(MgzField, TagsWithoutALengthAreSkippedAndNoneMayBeCut) {
  const Scratch scratch;
  const std::string plain = read_bytes(std::filesystem::path(TETWARP_FUZZ_CORPUS) / "mgz" / "plain.mgz");
  const FieldFile expected = read_field_file(std::filesystem::path(TETWARP_FUZZ_CORPUS) / "mgz" / "plain.mgz");
  const std::int64_t vertices = voxel_count(expected.grid);
  const std::size_t tags = 284 + 12 * static_cast<std::size_t>(vertices) + 20;
  // mri_warp_convert puts the labels of all vertices before the form of the vectors.
  std::string labels = big_endian(12);
  for (std::int32_t n = 0; n < vertices; ++n) labels += big_endian(13 - n);
  const std::string whole = plain.substr(0, tags) + big_endian(11) + big_endian(2) + labels + plain.substr(tags);
  write_file(scratch / "a.mgz", whole);
  EXPECT_EQ(read_field_file(scratch / "a.mgz").displacement, expected.displacement);
  for (std::size_t size = 0; size < whole.size(); size += size < 90 ? 1 : 4) {
    write_file(scratch / "a.mgz", whole.substr(0, size));
    const std::string why = refused_field(scratch / "a.mgz");
    // Between two tags a file may end.
    EXPECT_TRUE(says(why, {"truncated", "a.mgz"}) || says(why, {"empty", "a.mgz"}) ||
                says(why, {"the form of the vectors is not stated", "a.mgz"}) || (why.empty() && size > tags + 20))
        << size << why;
    EXPECT_TRUE(size == 0 || size >= tags || says(why, {"truncated"})) << size << why;
  }
  const std::size_t form = plain.find(big_endian(13), tags);
  ASSERT_NE(form, std::string::npos);
  write_file(scratch / "a.mgz", plain.substr(0, form + 11) + '\x03' + plain.substr(form + 12));
  EXPECT_TRUE(says(refused_field(scratch / "a.mgz"), {"tag 13 of 3 bytes"}));
}

TEST(MgzField, AWarpWithFewerVerticesThanItsTargetHasVoxelsIsRefused) {
  const Scratch scratch;
  const std::filesystem::path plain = std::filesystem::path(TETWARP_FUZZ_CORPUS) / "mgz" / "plain.mgz";
  const glm::i64vec3 size = read_field_header(plain).grid.size;
  const std::string bytes = read_bytes(plain);
  const std::size_t tags = 284 + 12 * static_cast<std::size_t>(size.x * size.y * size.z) + 20;
  std::string geometries = big_endian(10) + std::string(588, '\0') + big_endian(1);  // no source, and a target of
  for (int axis = 0; axis < 3; ++axis) geometries += big_endian(static_cast<std::int32_t>(2 * size[axis]));
  const std::string one("\x3f\x80\0\0", 4), zero(4, '\0');
  for (const char number : std::string("111100010001000")) geometries += number == '1' ? one : zero;
  geometries += std::string(512, '\0');
  write_file(scratch / "a.mgz", bytes.substr(0, tags) + geometries + bytes.substr(tags));
  EXPECT_TRUE(says(refused_field(scratch / "a.mgz"), {"vertices for a target volume of", "a.mgz", "spacing 1"}));
}

TEST(NpzField, TheKeyIsChosenAndDamageIsRefused) {
  const std::filesystem::path folder = std::filesystem::path(TETWARP_FUZZ_CORPUS) / "npz";
  const std::string order = "order=xyz,units=mm";
  EXPECT_TRUE(says(refused_field(folder / "two.npz", order), {"2 arrays (vol, other)", "key=NAME"}));
  EXPECT_EQ(refused_field(folder / "two.npz", "key=other," + order), "");
  EXPECT_TRUE(says(refused_field(folder / "two.npz", "key=none," + order), {"no such array", "none"}));
  EXPECT_TRUE(says(refused_field(folder / "stored.npz", ""), {"give both"}));
  // Truncated, or with a byte turned over: refused, or what is missing is not looked at and the field is the same.
  const Scratch scratch;
  const std::string bytes = read_bytes(folder / "deflated.npz");
  FieldSource good = with(folder / "deflated.npz", order);
  good.grid.emplace();
  good.grid->size = {2, 2, 2};
  const PullField whole = read_pull_field(good);
  const auto expect_harmless = [&](const std::string& damaged, std::size_t at) {
    write_file(scratch / "a.npz", damaged);
    good.path = scratch / "a.npz";
    const std::string why = refusal([&] {
      const PullField field = read_pull_field(good);
      EXPECT_EQ(field.displacement, whole.displacement) << at;
    });
    EXPECT_TRUE(why.empty() || says(why, {"InputError", "a.npz"})) << at << why;
    return !why.empty();
  };
  std::size_t refused = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(~damaged[at]);
    refused += expect_harmless(damaged, at) + expect_harmless(bytes.substr(0, at), at);
  }
  EXPECT_GT(refused, bytes.size());
}

TEST(NiftiField, OptionsSayWhatTheFileDoesNotAndNothingElse) {
  const std::filesystem::path folder = std::filesystem::path(TETWARP_FUZZ_CORPUS) / "nii-vectors";
  const std::filesystem::path volumes = folder / "volumes.nii", spm = folder / "spm.nii";
  // Three volumes may be three times.
  EXPECT_TRUE(says(refusal([&] { is_field_file(volumes); }),
                   {"3 time points", ":values=displacements|positions,frame=lps|ras"}));
  EXPECT_TRUE(is_field_file(with(volumes, "values=positions")));
  EXPECT_TRUE(says(refused_field(volumes), {"does not state", ":values=displacements|positions,frame=lps|ras"}));
  for (const char* half : {"values=displacements", "frame=ras"})
    EXPECT_TRUE(says(refused_field(volumes, half), {"does not state", "volumes.nii"})) << half;
  const FieldFile lps = read_field_file(with(volumes, "values=displacements,frame=lps")),
                  ras = read_field_file(with(volumes, "values=displacements,frame=ras"));
  EXPECT_EQ(lps.displacement.back(), glm::vec3(3, 5, 7));
  EXPECT_EQ(ras.displacement.back(), glm::vec3(-3, -5, 7));
  const FieldFileHeader header = read_field_header(with(volumes, "values=positions,frame=ras"));
  EXPECT_TRUE(header.absolute);
  EXPECT_EQ(header.absolute_basis, FieldBasis::by_option);
  EXPECT_EQ(header.frame_basis, FieldBasis::by_option);
  EXPECT_TRUE(says(refused_field(volumes, "values=vectors"), {"values=vectors", "displacements or positions"}));
  EXPECT_TRUE(says(refused_field(volumes, "source=a.nii,values=positions,frame=ras"), {"only the fields of FSL"}));
  // nibabel writes five axes without an intent.
  const Scratch scratch;
  std::string unstated = read_bytes(volumes);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    std::int16_t sizes[6] = {5, 0, 0, 0, 1, 3};
    if (axis == 0 || axis > 3) put(unstated, 40 + 2 * axis, sizes[axis]);
  }
  write_file(scratch / "five.nii", unstated);
  EXPECT_TRUE(says(refusal([&] { is_field_file(scratch / "five.nii"); }),
                   {"3 values a voxel with intent code 0", ":values=displacements|positions,frame=lps|ras"}));
  EXPECT_EQ(read_field_file(with(scratch / "five.nii", "values=displacements,frame=ras")).displacement,
            ras.displacement);
  EXPECT_EQ(read_field_header(spm).direction, Direction::pull);
  EXPECT_TRUE(read_field_header(spm).absolute);
  EXPECT_TRUE(says(refused_field(spm, "values=displacements"), {"holds positions", "spm.nii"}));
  EXPECT_TRUE(says(refused_field(spm, "frame=lps"), {"are in RAS", "spm.nii"}));
}

TEST(NiftiField, AFieldOfFslNeedsItsMovingImage) {
  const std::filesystem::path file = kCases / "fsl-fnirt-relative" / "warp.nii.gz";
  EXPECT_TRUE(is_field_file(file));
  EXPECT_TRUE(says(refused_field(file), {"does not say whether", "values=displacements|positions,source=MOVING"}));
  EXPECT_TRUE(says(refused_field(file, "values=displacements"), {"source=MOVING"}));
  EXPECT_TRUE(says(refused_field(file, "values=displacements,source=absent.nii"), {"absent.nii"}));
  const Scratch scratch;
  std::string bytes =
      read_bytes(std::filesystem::path(TETWARP_FUZZ_CORPUS) / "nii-vectors" / "refused-fsl-without-source.nii");
  put(bytes, 68, std::int16_t{2007});
  write_file(scratch / "coefficients.nii", bytes);
  EXPECT_TRUE(says(refused_field(scratch / "coefficients.nii", "values=displacements,frame=lps"),
                   {"coefficients of fnirt", "a transform"}));
}

TEST(FnirtCoefficients, LeadBetweenTheirTwoImagesAndNoOthers) {
  const Scratch scratch;
  const std::filesystem::path file = std::filesystem::path(TETWARP_FUZZ_CORPUS) / "transform-fnirt" / "cubic.nii";
  const std::string moving = (kCases / "moving.nii.gz").string(), fixed = (kCases / "fixed.nii.gz").string();
  const std::string images = "source=" + moving + ",reference=" + fixed;
  EXPECT_TRUE(is_transform_file(file));
  EXPECT_FALSE(is_field_file(file));
  const TransformFile transform = read_transform_file(with(file, images));
  EXPECT_EQ(transform.direction, Direction::pull);
  EXPECT_EQ(transform.frame, "FSL");
  EXPECT_EQ(files_of_transform(with(file, images)).size(), 3U);
  transform.displacement(point_from_index(read_image_header(fixed).geometry)(glm::dvec3(1, 2, 3)));
  EXPECT_EQ(transform.outside->load(), 0U);
  transform.displacement(point_from_index(read_image_header(fixed).geometry)(glm::dvec3(-1, 2, 3)));
  EXPECT_EQ(transform.outside->load(), 1U);
  EXPECT_TRUE(says(refused_transform(file), {"two images", "source=MOVING,reference=FIXED"}));
  EXPECT_TRUE(says(refused_transform(file, images + ",invert=yes"), {"only affine ones"}));
  EXPECT_TRUE(says(refused_transform(file, images + ",values=positions"), {"\"values\"", "expected source"}));
  EXPECT_TRUE(says(refused_transform(file, "source=" + fixed + ",reference=" + moving),
                   {"coefficients for a reference of", "moving.nii.gz has"}));
  std::string bytes = read_bytes(file);
  const auto refused = [&](std::size_t offset, auto value) {
    std::string changed = bytes;
    put(changed, offset, value);
    write_file(scratch / "a.nii", changed);
    return refused_transform(scratch / "a.nii", images);
  };
  EXPECT_TRUE(says(refused(68, std::int16_t{2008}), {"cosine coefficients", "fnirtfileutils", "a.nii"}));
  EXPECT_TRUE(says(refused(68, std::int16_t{2009}), {"quadratic coefficients", "a.nii"}));
  EXPECT_TRUE(says(refused(254, std::int16_t{0}), {"without qform or sform", "a.nii"}));
  EXPECT_TRUE(says(refused(352, NAN), {"not finite", "a.nii"}));
  EXPECT_TRUE(says(refused(56, 1.0F), {"coefficients for a reference", "a.nii"}));
  expect_truncation_refused(
      file, "a.nii",
      [&](const auto& path) { return is_transform_file(path) ? refused_transform(path, images) : "InputError a.nii"; },
      101);
}

#ifdef TETWARP_WITH_DCMTK
TEST(SpatialRegistration, LeadsFromMovingToFixedAndDamageIsRefused) {
  const std::filesystem::path file = kCases / "dicom-spatial-registration" / "sro.dcm";
  ASSERT_TRUE(is_transform_file(file));
  EXPECT_FALSE(is_field_file(file));
  const TransformFile registration = read_transform_file(file);
  EXPECT_EQ(registration.direction, Direction::forward);
  EXPECT_EQ(registration.tool, "DICOM");
  const TransformFile second = read_transform_file(with(file, "item=2"));
  EXPECT_TRUE(registration.displacement({1, 2, 3}) == second.displacement({1, 2, 3}) ||
              registration.displacement({1, 2, 3}) ==
                  read_transform_file(with(file, "item=1")).displacement({1, 2, 3}));
  EXPECT_TRUE(says(refused_transform(file, "item=9"), {"no item 9", "sro.dcm"}));
  EXPECT_TRUE(says(refused_transform(file, "tool=greedy"), {"tool", "expected item"}));
  const Scratch scratch;
  const std::string bytes = read_bytes(file);
  for (std::size_t size = 140; size < bytes.size(); size += 61) {
    write_file(scratch / "a.dcm", bytes.substr(0, size));
    if (!is_transform_file(scratch / "a.dcm")) continue;
    EXPECT_TRUE(says(refused_transform(scratch / "a.dcm"), {"InputError", "a.dcm"})) << size;
  }
}
#endif

}  // namespace
}  // namespace tetwarp
