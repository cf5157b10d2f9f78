// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a text of -f and --pull-field is parsed into, and what the value says.
#include <gtest/gtest.h>

#include "apps/cli/input.h"
#include "apps/fields/read_field.h"
#include "deform/fields/formula.h"
#include "io/transform_file.h"
#include "tests/support/field_texts.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;
using namespace tetwarp::apps;

namespace fs = std::filesystem;

const Geometry kVolume{.size = {6, 5, 4}, .spacing = {2, 2, 3}};

ForwardChoice parse(const std::vector<std::string>& texts, std::optional<std::int64_t> cell_size = {}) {
  return parse_forward_fields(texts, cell_size, NiftiFrame::sform);
}

PullChoice parse_pull(const std::string& text) { return parse_pull_fields({text}, NiftiFrame::sform); }

std::string usage_error(const std::vector<std::string>& texts, std::optional<std::int64_t> cell_size = {}) {
  try {
    parse(texts, cell_size);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

/// A folder with a file of each kind.
class FieldFiles : public testing::Test {
 protected:
  void SetUp() override {
    write_field_file(scratch_ / "lattice.mha", twist(kVolume, 0.1, 1));
    write_file(scratch_ / "rest.msh", tetrahedron(0));
    write_file(scratch_ / "deformed.msh", tetrahedron(3));
    write_file(scratch_ / "first.txt", translation("NoInitialTransform"));
    write_file(scratch_ / "second.txt", translation((scratch_ / "first.txt").string()));
  }
  std::string at(const std::string& name) const { return (scratch_ / name).string(); }
  std::string mesh() const { return at("rest.msh") + ":deformed=" + at("deformed.msh"); }
  /// A build without ITK reads none.
  bool reads_transforms() const {
    try {
      read_transform_file(fs::path(at("first.txt")));
      return true;
    } catch (const NotCompiled&) {
      return false;
    }
  }

  Scratch scratch_;
};

TEST(FieldChoice, AFormulaReadsNothingAndKeepsItsText) {
  const ForwardChoice parsed = parse({"wave:amplitude=8,wavelength=64vox", "identity"}, 4);
  ASSERT_EQ(parsed.fields.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<NamedFormula>(parsed.fields[0].what));
  EXPECT_EQ(parsed.fields[0].text, "wave:amplitude=8,wavelength=64vox");
  EXPECT_EQ(parsed.cell_size, 4);
  EXPECT_TRUE(files_of(parsed).empty());
  EXPECT_EQ(title_of(parsed), "wave:amplitude=8,wavelength=64vox, then identity");
  EXPECT_EQ(title_without_names(parsed), title_of(parsed));
}

TEST(FieldChoice, WhatIsWrongWithAFormulaIsAMistakeOfTheCommandLine) {
  EXPECT_TRUE(says(usage_error({"wave:amplitud=8,wavelength=64"}), {"amplitude is missing"}));
  EXPECT_TRUE(says(usage_error({"twist:angle=x"}), {"angle is \"x\", expected a number"}));
  EXPECT_TRUE(says(usage_error({"twirl:angle=3"}), {"\"twirl:angle=3\" is neither a formula nor a file that exists"}));
  EXPECT_TRUE(says(usage_error({}), {"no field; give -f FIELD"}));
  EXPECT_TRUE(says(usage_error({"identity"}, 0), {"--cell-size is 0"}));
  const ForwardChoice fine = parse({"elastic:amplitude=1,spacing=0.0001,seed=1"});
  const Geometry huge{.size = {1000, 1000, 1000}};
  EXPECT_THROW(read_field(fine, huge, 1, {}), UsageError) << "parameters that do not go with the volume";
}

TEST_F(FieldFiles, AreToldApartOnce) {
  const ForwardChoice parsed = parse({mesh(), at("lattice.mha"), at("second.txt")});
  EXPECT_TRUE(std::holds_alternative<NamedMesh>(parsed.fields[0].what));
  EXPECT_TRUE(std::holds_alternative<NamedLattice>(parsed.fields[1].what));
  EXPECT_TRUE(std::holds_alternative<NamedTransform>(parsed.fields[2].what));
  EXPECT_EQ(parsed.fields[0].text, mesh());
  EXPECT_EQ(source_of(parsed.fields[0])->option("deformed"), at("deformed.msh"));
  EXPECT_EQ(source_of(parsed.fields[2]), nullptr);
}

TEST_F(FieldFiles, AreAllNamedThatAFieldIsReadFrom) {
  const auto files = files_of(parse({mesh(), at("lattice.mha"), at("second.txt")}));
  std::vector<fs::path> expected = {scratch_ / "rest.msh", scratch_ / "deformed.msh", scratch_ / "lattice.mha",
                                    scratch_ / "second.txt"};
  if (reads_transforms()) expected.push_back(scratch_ / "first.txt");
  EXPECT_EQ(files, expected);
}

TEST_F(FieldFiles, AreTitledWithoutFoldersOrNotAtAll) {
  const FieldChoice parsed = parse({at("lattice.mha"), "identity", at("first.txt")});
  EXPECT_EQ(title_of(parsed), "lattice.mha, then identity, then first.txt");
  EXPECT_EQ(title_without_names(parsed), "a field of a file, then identity, then a field of a file");
  const FieldChoice pull = parse_pull(at("lattice.mha"));
  EXPECT_EQ(title_of(pull), "pull field lattice.mha");
  EXPECT_EQ(title_without_names(pull), "deformed");
}

TEST_F(FieldFiles, WithVerticesOfTheirOwnTakeNoCellSizeAndAMeshComesFirst) {
  EXPECT_TRUE(says(usage_error({at("lattice.mha")}, 2), {"--cell-size is for formulas", "has its own vertices"}));
  EXPECT_TRUE(says(usage_error({mesh()}, 2), {"has its own vertices"}));
  EXPECT_TRUE(says(usage_error({"identity", mesh()}), {"the mesh", "comes after another field"}));
  EXPECT_EQ(usage_error({at("first.txt"), at("lattice.mha")}, 2), "");
  EXPECT_TRUE(says(usage_error({at("lattice.mha") + ":order=zyx"}), {"files of its format take none"}));
  EXPECT_TRUE(says(usage_error({at("rest.msh") + ":n=1"}), {"a mesh takes displacement, step, deformed"}));
}

TEST_F(FieldFiles, OfAPullFieldNeedNotExistAndAreNoFormulas) {
  const NamedField missing = parse_pull(at("missing.mha")).fields[0];
  EXPECT_TRUE(std::holds_alternative<NamedLattice>(missing.what));
  EXPECT_EQ(files_of(missing).size(), 1u);
  const NamedField wave = parse_pull("wave").fields[0];
  EXPECT_TRUE(std::holds_alternative<NamedLattice>(wave.what)) << "a file of this name";
  EXPECT_EQ(files_of(wave).size(), 1u);
  EXPECT_THROW(parse_pull(mesh()), InputError) << "a mesh is a forward field";
}

/// Points go through the first of several, and from there on.
TEST_F(FieldFiles, OfSeveralPullFieldsAreComposedInTheirOrder) {
  const Geometry wide{.size = {9, 8, 7}, .spacing = {2, 2, 3}, .origin = {-4, -4, -6}};
  PullField sheared{wide, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(wide)))};
  const AffineMap point = point_from_index(wide);
  for (std::size_t v = 0; v < sheared.displacement.size(); ++v) {
    const auto n = static_cast<std::int64_t>(v);
    const glm::dvec3 at = point(glm::dvec3(n % 9, n / 9 % 8, n / 72));
    sheared.displacement[v] = {0.25 * at.y, 0, 0};
  }
  write_field_file(scratch_ / "sheared.mha", sheared);
  write_file(scratch_ / "scale.mat", "1 0 0 0\n0 0.5 0 1\n0 0 1 0\n0 0 0 1\n");
  const std::string scale = at("scale.mat") + ":tool=greedy";  // LPS: y becomes y / 2 - 1
  const auto composed = [&](const std::vector<std::string>& texts) {
    return read_field(parse_pull_fields(texts, NiftiFrame::sform), kVolume, 1, {});
  };
  const auto moved = [&](const ReadPullField& read, const glm::i64vec3& i) {
    const Geometry& grid = read.field.grid;
    const auto v = static_cast<std::size_t>(i.x + grid.size.x * (i.y + grid.size.y * i.z));
    return point_from_index(grid)(glm::dvec3(i)) + glm::dvec3(read.field.displacement[v]);
  };
  // The grid is that of the first, or of the output.
  const ReadPullField field_first = composed({at("sheared.mha"), scale}),
                      matrix_first = composed({scale, at("sheared.mha")});
  EXPECT_EQ(field_first.field.grid.size, wide.size);
  EXPECT_EQ(matrix_first.field.grid.size, kVolume.size);
  EXPECT_EQ(moved(field_first, {2, 5, 1}), glm::dvec3(0 + 0.25 * 6, 6 / 2 - 1, -3));
  EXPECT_EQ(moved(matrix_first, {2, 4, 1}), glm::dvec3(4 + 0.25 * 3, 8 / 2 - 1, 3));
  EXPECT_EQ(moved(matrix_first, {2, 3, 1}), glm::dvec3(4 + 0.25 * 2, 6 / 2 - 1, 3)) << "between samples";
  ASSERT_EQ(field_first.origin.files.size(), 2u);
  EXPECT_EQ(field_first.origin.files[0].parts[0].sha256, hash_file(at("sheared.mha")));
  EXPECT_EQ(field_first.origin.files[1].parts[0].sha256, hash_file(at("scale.mat")));

  // What leads out of the grid of a later field has no source, and is counted.
  write_file(scratch_ / "far.mat", "1 0 0 -12\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");  // LPS: x + 12
  const ReadPullField out = composed({at("far.mat") + ":tool=c3d", at("sheared.mha")});
  std::size_t missing = 0;
  for (const glm::vec3& by : out.field.displacement) missing += std::isnan(by.x) ? 1 : 0;
  EXPECT_EQ(missing, out.field.displacement.size() - 1 * 5 * 4) << "of x, 12 alone is not beyond the grid";
  EXPECT_TRUE(says(out.origin.notes.back(), {"sheared.mha: 100 samples", "no source"}));

  // A transform that leads the other way is refused, its inverse is not.
  EXPECT_EQ(moved(composed({scale + ",invert=yes"}), {0, 1, 0}), glm::dvec3(0, 6, 0));
  EXPECT_TRUE(composed({scale + ",invert=yes"}).origin.notes.empty());
  EXPECT_EQ(text_of(parse_pull_fields({"a.mha", scale}, NiftiFrame::sform)), "a.mha, then " + scale);

  // An array has no place of its own: it lies on the output, and behind another field nowhere.
  const std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 5, 6, 3), }\n";
  write_file(scratch_ / "array.npy", std::string("\x93NUMPY\x01\0", 8) + static_cast<char>(header.size()) + '\0' +
                                         header + std::string(4 * 5 * 6 * 3 * sizeof(float), '\0'));
  const std::string array = at("array.npy") + ":order=zyx,units=mm";
  EXPECT_EQ(composed({array}).field.grid, kVolume);
  EXPECT_TRUE(says(refusal([&] { composed({scale, array}); }), {"array.npy", "no place of its own"}));
  EXPECT_FALSE(is_affine(parse_pull_fields({scale, at("sheared.mha")}, NiftiFrame::sform)));
  EXPECT_TRUE(is_affine(parse_pull_fields({scale, scale + ",invert=yes"}, NiftiFrame::sform)));
}

TEST(FieldChoice, FilesGetOtherNamesAndFormulasStay) {
  const auto renamed = [](const std::string& text) {
    return with_files_renamed(text, [](const std::string& file) { return "there/" + file; });
  };
  EXPECT_EQ(renamed("wave:amplitude=8,wavelength=64"), "wave:amplitude=8,wavelength=64");
  EXPECT_EQ(renamed("f.npy:units=mm,order=zyx"), "there/f.npy:units=mm,order=zyx") << "as it was given";
  EXPECT_EQ(renamed("rest.msh:units=mm,deformed=d.msh"), "there/rest.msh:deformed=there/d.msh,units=mm");
}

TEST_F(FieldFiles, HaveTheSizeThatIsSaidBeforeTheyAreRead) {
  const auto size_of = [](const ForwardChoice& text) { return size_bytes(read_field(text, kVolume, 1, {}).field); };
  std::vector<ForwardChoice> texts = {parse({"identity"}, 2), parse({at("lattice.mha")})};
  if (reads_transforms()) texts.push_back(parse({at("first.txt")}));
  for (const ForwardChoice& text : texts)
    EXPECT_EQ(field_bytes(text, kVolume), size_of(text)) << text.fields.front().text;
  EXPECT_GE(field_bytes(parse({mesh()}), kVolume), size_of(parse({mesh()}))) << "and what a mesh needs for its work";
}

TEST_F(FieldFiles, AreReadAsTheyAreTitled) {
  const ReadForwardField lattice = read_field(parse({at("lattice.mha")}), kVolume, 1, {});
  EXPECT_EQ(hash_field(lattice.field, 1), hash_field(twist(kVolume, 0.1, 1), 1));
  ASSERT_EQ(lattice.origin.files.size(), 1u);
  EXPECT_EQ(lattice.origin.files[0].parts[0].path, at("lattice.mha"));
  EXPECT_FALSE(lattice.origin.identity);
  EXPECT_TRUE(read_field(parse({"identity", "identity"}), kVolume, 1, {}).origin.identity);
  if (!reads_transforms()) GTEST_SKIP() << "no ITK in this build";
  const ReadPullField moved = read_field(parse_pull(at("second.txt")), kVolume, 1, {});
  EXPECT_EQ(moved.field.displacement.front(), glm::vec3(2, 0, 0)) << "both translations";
}

}  // namespace
