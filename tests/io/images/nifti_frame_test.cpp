// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// NIfTI files that state their place twice: which of the two counts, and what is said of it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <random>
#include <sstream>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/image_samples.h"
#include "tests/support/itk_image_io.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

constexpr std::size_t kQformCode = 252, kSformCode = 254, kPixdim = 76, kQuaternion = 256, kQoffset = 268, kSrow = 280;

/// The bytes of a file whose qform and sform are equal.
std::string even_file(const Scratch& scratch, const Geometry& grid = oblique_grid(), int components = 1) {
  const VoxelType type = components == 1 ? VoxelType::i16 : VoxelType::f32;
  write_image(scratch / "even.nii", numbered(grid, type, components).view());
  return read_bytes(scratch / "even.nii");
}

std::string with_codes(std::string bytes, int qform, int sform) {
  put(bytes, kQformCode, static_cast<std::int16_t>(qform));
  put(bytes, kSformCode, static_cast<std::int16_t>(sform));
  return bytes;
}

/// The qform `mm` further to the patient's left.
std::string with_moved_qform(std::string bytes, float mm) {
  put(bytes, kQoffset, get<float>(bytes, kQoffset) - mm);
  return bytes;
}

std::string written(const Scratch& scratch, const std::string& name, const std::string& bytes) {
  write_file(scratch / name, bytes);
  return (scratch / name).string();
}

bool has_note(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform) {
  return !read_image_header(path, frame).notes.empty();
}

/// Where nibabel places files: columns to LPS mm, 12 numbers a file.
std::vector<Geometry> by_nibabel(const Scratch& scratch, const std::vector<std::string>& files,
                                 const glm::i64vec3& size) {
  const std::string script =
      "import nibabel, sys\n"
      "for name in open(sys.argv[1]).read().split('\\n'):\n"
      "  if name: print(*['%.17g' % v for v in nibabel.load(name).affine[:3, :4].T.ravel()])\n";
  write_file(scratch / "script.py", script);
  std::string list;
  for (const std::string& file : files) list += file + "\n";
  write_file(scratch / "list", list);
  const std::string command = std::string("'") + TETWARP_PYTHON + "' '" + (scratch / "script.py").string() + "' '" +
                              (scratch / "list").string() + "' > '" + (scratch / "out").string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::istringstream out(read_bytes(scratch / "out"));
  std::vector<Geometry> grids;
  for (std::size_t n = 0; n < files.size(); ++n) {
    Geometry& grid = grids.emplace_back();
    grid.size = size;
    for (int axis = 0; axis < 4; ++axis) {
      glm::dvec3 column(NAN);
      out >> column.x >> column.y >> column.z;
      column *= glm::dvec3(-1, -1, 1);
      if (axis == 3) {
        grid.origin = column;
        break;
      }
      grid.spacing[axis] = glm::length(column);
      grid.direction[axis] = column / grid.spacing[axis];
    }
  }
  return grids;
}

/// Ways in which the forms differ, or not.
struct Difference {
  const char* name;
  bool noted;
  std::string (*make)(std::string bytes);
};

std::string turned(std::string bytes) {  // half a turn about x more: b' = a, a' = -b, ...
  const float b = get<float>(bytes, kQuaternion), c = get<float>(bytes, kQuaternion + 4),
              d = get<float>(bytes, kQuaternion + 8), a = std::sqrt(1 - b * b - c * c - d * d);
  const float sign = b > 0 ? -1.0f : 1.0f;
  put(bytes, kQuaternion, sign * a);
  put(bytes, kQuaternion + 4, sign * d);
  put(bytes, kQuaternion + 8, sign * -c);
  return bytes;
}

const Difference kDifferences[] = {
    {"equal", false, [](std::string bytes) { return bytes; }},
    {"moved", true, [](std::string bytes) { return with_moved_qform(std::move(bytes), 5); }},
    {"moved a little", true, [](std::string bytes) { return with_moved_qform(std::move(bytes), 0.02f); }},
    {"turned", true, turned},
    {"other handedness", true,
     [](std::string bytes) {
       put(bytes, kPixdim, -get<float>(bytes, kPixdim));
       return bytes;
     }},
};

bool has_nibabel() {
  return std::system((std::string("'") + TETWARP_PYTHON + "' -c 'import nibabel' 2> /dev/null").c_str()) == 0;
}

TEST(NiftiFrame, SformIsTakenAsNibabelHasItAndQformAsItkHasItOverAllCodes) {
  const Scratch scratch;
  const std::string good = even_file(scratch);
  struct Case {
    std::string file;
    int qform, sform;
    const Difference* difference;
  };
  std::vector<Case> cases;
  std::vector<std::string> files;
  for (const Difference& difference : kDifferences) {
    for (int qform = 0; qform <= 4; ++qform) {
      for (int sform = 0; sform <= 4; ++sform) {
        if (qform == 0 && sform == 0) continue;
        const std::string name = "f" + std::to_string(cases.size()) + ".nii";
        files.push_back(written(scratch, name, with_codes(difference.make(good), qform, sform)));
        cases.push_back({files.back(), qform, sform, &difference});
      }
    }
  }
  const std::vector<Geometry> nibabel =
      has_nibabel() ? by_nibabel(scratch, files, oblique_grid().size) : std::vector<Geometry>();
  for (std::size_t n = 0; n < cases.size(); ++n) {
    const Case& one = cases[n];
    const std::string what = std::string(one.difference->name) + ", qform " + std::to_string(one.qform) + ", sform " +
                             std::to_string(one.sform);
    const ImageHeader by_sform = read_image_header(one.file), by_qform = read_image_header(one.file, NiftiFrame::qform);
    EXPECT_TRUE(nibabel.empty() || same_grid(by_sform.geometry, nibabel[n], 1e-4)) << what;
    const Geometry itk = itk_read_info(one.file, ItkFormat::nifti).geometry;
    const bool itk_takes_sform = one.sform == 1 || one.qform == 0, may_take_either = itk_version() != "5.2";
    EXPECT_TRUE(same_grid((itk_takes_sform ? by_sform : by_qform).geometry, itk, 1e-4) ||
                (may_take_either && same_grid(by_sform.geometry, itk, 1e-4)))
        << what;
    const bool noted = one.difference->noted && one.qform > 0 && one.sform > 0;
    EXPECT_EQ(!by_sform.notes.empty(), noted) << what;
    EXPECT_EQ(!by_qform.notes.empty(), noted) << what;
    EXPECT_EQ(same_grid(by_sform.geometry, by_qform.geometry, 1e-3), !noted) << what;
  }
  written(scratch, "none.nii", with_codes(good, 0, 0));
  EXPECT_NE(refusal([&] { read_image(scratch / "none.nii"); }).find("no orientation"), std::string::npos);
}

TEST(NiftiFrame, NoteNamesCodesDistanceAndTheOption) {
  const Scratch scratch;
  written(scratch, "x.nii", with_codes(with_moved_qform(even_file(scratch), 5), 1, 2));
  const std::string by_sform = read_image_header(scratch / "x.nii").notes.at(0),
                    by_qform = read_image_header(scratch / "x.nii", NiftiFrame::qform).notes.at(0);
  EXPECT_EQ(by_sform,
            "the sform (code 2) and the qform (code 1) lie up to 5 mm apart: placed by the sform, --nifti-frame qform "
            "takes the other");
  EXPECT_EQ(
      by_qform,
      "the sform (code 2) and the qform (code 1) lie up to 5 mm apart: placed by the qform, as --nifti-frame says");
}

TEST(NiftiFrame, RoundingOfWritersIsNoDifference) {
  const Scratch scratch;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Geometry> grids = all_orientations();
  for (int n = 0; n < 300; ++n) {
    // Every second one nearly half a turn, where a quaternion in float32 is least exact.
    const double near = n % 2 == 0 ? 1 : 1e-3;
    const glm::dvec4 q = glm::normalize(glm::dvec4(near * any(random), any(random), any(random), any(random)));
    const double a = q.x, b = q.y, c = q.z, d = q.w;
    Geometry grid = all_orientations()[0];
    grid.size = {400, 300, 250};
    grid.spacing = {0.7, 0.9, 1.3};
    grid.origin = 300.0 * glm::dvec3(any(random), any(random), any(random));
    grid.direction = glm::dmat3(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c),
                                2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b),
                                2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c);
    if (n % 3 == 0) grid.direction[2] *= -1.0;
    grids.push_back(grid);
  }
  for (std::size_t n = 0; n < grids.size(); ++n) {
    Geometry one = grids[n];
    one.size = {2, 2, 2};
    std::string bytes = even_file(scratch, one);
    const glm::i64vec3& size = grids[n].size;  // the file is as large as its header says, but sparse
    for (int axis = 0; axis < 3; ++axis) put(bytes, 42 + 2 * axis, static_cast<std::int16_t>(size[axis]));
    written(scratch, "x.nii", bytes);
    std::filesystem::resize_file(scratch / "x.nii", 352 + 2 * static_cast<std::size_t>(size.x * size.y * size.z));
    EXPECT_FALSE(has_note(scratch / "x.nii")) << n;
  }
}

TEST(NiftiFrame, VoxelSizesThatDisagreeAreRefusedWhereTheSformCountsAndSayWhatToDo) {
  const Scratch scratch;
  const std::string good = even_file(scratch);
  for (const int sform : {1, 2, 4}) {
    std::string pixdim = with_codes(good, 1, sform), sheared = pixdim;
    put(pixdim, kPixdim + 4, 1.0f);
    put(sheared, kSrow + 4, get<float>(sheared, kSrow + 4) + 0.05f);
    for (const auto& [bytes, why] : {std::pair(pixdim, "by pixdim"), {sheared, "a sheared or singular sform"}}) {
      written(scratch, "x.nii", bytes);
      const std::string text = refusal([&] { read_image_header(scratch / "x.nii"); });
      EXPECT_TRUE(text.starts_with("InputError: ") && text.find(why) != std::string::npos) << text;
      EXPECT_NE(text.find("or give --nifti-frame qform"), std::string::npos) << text;
      EXPECT_TRUE(has_note(scratch / "x.nii", NiftiFrame::qform));
      written(scratch, "x.nii", with_codes(bytes, 0, sform));
      EXPECT_EQ(refusal([&] { read_image_header(scratch / "x.nii", NiftiFrame::qform); }).find("--nifti-frame"),
                std::string::npos);
    }
  }
}

TEST(NiftiFrame, FieldsFollowTheSameRule) {
  const Scratch scratch;
  const std::string bytes = with_codes(with_moved_qform(even_file(scratch, oblique_grid(), 3), 5), 1, 2);
  FieldSource source(written(scratch, "field.nii", bytes));
  const FieldFileHeader by_sform = read_field_header(source);
  source.nifti_frame = NiftiFrame::qform;
  const FieldFileHeader by_qform = read_field_header(source);
  EXPECT_TRUE(same_grid(by_sform.grid, oblique_grid(), 2e-5));
  EXPECT_NEAR(by_qform.grid.origin.x, oblique_grid().origin.x + 5, 1e-4);
  EXPECT_EQ(by_sform.notes.size(), 1u);
  EXPECT_EQ(by_qform.notes.size(), 1u);
  EXPECT_EQ(read_forward_field(source).lattice.origin, by_qform.grid.origin);

  std::string sheared = bytes;
  put(sheared, kSrow + 4, get<float>(sheared, kSrow + 4) + 0.05f);
  written(scratch, "field.nii", sheared);
  EXPECT_TRUE(is_field_file(source));
  EXPECT_NO_THROW(read_forward_field(source));
  source.nifti_frame = NiftiFrame::sform;
  EXPECT_NE(refusal([&] { is_field_file(source); }).find("sheared"), std::string::npos);
}

}  // namespace
}  // namespace tetwarp
