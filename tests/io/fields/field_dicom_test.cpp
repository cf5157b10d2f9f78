// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Deformable Spatial Registration objects of DICOM as fields: made by pydicom, by plastimatch, and value by value.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/matrix.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/foreign_field.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

/// One item of a Deformable Registration Sequence, as text and numbers of the file.
struct MadeItem {
  std::string source_frame = "1.2.3.4";
  std::string position = "10\\-20\\30", orientation = "1\\0\\0\\0\\1\\0";
  std::vector<Uint32> dimensions = {4, 3, 2};
  std::vector<Float64> resolution = {1.5, 2, 2.5};
  std::vector<Float32> vectors = std::vector<Float32>(72, 0);
  std::string pre, post;  ///< 16 decimal strings; empty: no sequence
  bool has_grid = true;
  std::function<void(DcmItem&)> edit_grid;  ///< last word
};

void put_matrix(DcmItem& item, const DcmTagKey& sequence, const std::string& matrix) {
  if (matrix.empty()) return;
  DcmItem* only = nullptr;
  item.findOrCreateSequenceItem(sequence, only, -2);
  only->putAndInsertString(DCM_FrameOfReferenceTransformationMatrixType, "AFFINE");
  only->putAndInsertString(DCM_FrameOfReferenceTransformationMatrix, matrix.c_str());
}

void put_item(DcmDataset& data, const MadeItem& made) {
  DcmItem *item = nullptr, *grid = nullptr;
  data.findOrCreateSequenceItem(DCM_DeformableRegistrationSequence, item, -2);
  item->putAndInsertString(DCM_SourceFrameOfReferenceUID, made.source_frame.c_str());
  put_matrix(*item, DCM_PreDeformationMatrixRegistrationSequence, made.pre);
  put_matrix(*item, DCM_PostDeformationMatrixRegistrationSequence, made.post);
  if (!made.has_grid) return;
  item->findOrCreateSequenceItem(DCM_DeformableRegistrationGridSequence, grid, -2);
  grid->putAndInsertString(DCM_ImagePositionPatient, made.position.c_str());
  grid->putAndInsertString(DCM_ImageOrientationPatient, made.orientation.c_str());
  auto* size = new DcmUnsignedLong(DCM_GridDimensions);
  size->putUint32Array(made.dimensions.data(), made.dimensions.size());
  grid->insert(size, OFTrue);
  auto* resolution = new DcmFloatingPointDouble(DCM_GridResolution);
  resolution->putFloat64Array(made.resolution.data(), made.resolution.size());
  grid->insert(resolution, OFTrue);
  auto* vectors = new DcmOtherFloat(DCM_VectorGridData);
  vectors->putFloat32Array(made.vectors.data(), made.vectors.size());
  grid->insert(vectors, OFTrue);
  if (made.edit_grid) made.edit_grid(*grid);
}

void write_registration(const std::filesystem::path& path, const std::vector<MadeItem>& items,
                        const std::string& sop_class = UID_DeformableSpatialRegistrationStorage) {
  DcmFileFormat format;
  DcmDataset& data = *format.getDataset();
  data.putAndInsertString(DCM_SOPClassUID, sop_class.c_str());
  data.putAndInsertString(DCM_SOPInstanceUID, "1.2.3.5");
  data.putAndInsertString(DCM_Modality, "REG");
  data.putAndInsertString(DCM_FrameOfReferenceUID, "1.2.3.6");
  for (const MadeItem& item : items) put_item(data, item);
  ASSERT_TRUE(format.saveFile(path.c_str(), EXS_LittleEndianExplicit).good());
}

FieldSource item_of(const std::filesystem::path& path, const std::string& number) {
  return parse_field_source(path.string() + ":item=" + number);
}

Geometry right_handed(Geometry grid) {
  if (glm::determinant(grid.direction) < 0) grid.direction[2] = -grid.direction[2];
  return grid;
}

TEST(DicomField, CornerOnEveryGridInEveryEncoding) {
  const Scratch scratch;
  for (const Geometry& any : grids()) {
    const Geometry grid = right_handed(any);
    write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
    for (const std::string kind :
         {"dsr:explicit", "dsr:implicit", "dsr:big", "dsr:deflated", "dsr:explicit:matrices"}) {
      if (!make_foreign_field(kind, scratch / "f.mha", scratch / "f.dcm")) GTEST_SKIP() << "python3-pydicom";
      const bool matrices = kind.ends_with("matrices");
      const FieldFileHeader header = read_field_header(scratch / "f.dcm");
      EXPECT_EQ(header.format,
                std::string("DICOM Deformable Spatial Registration") + (matrices ? ", with its matrices" : ""));
      EXPECT_EQ(header.direction, Direction::pull);
      EXPECT_EQ(header.direction_basis, FieldBasis::by_format);
      EXPECT_EQ(header.frame, "LPS");
      EXPECT_EQ(header.frame_basis, FieldBasis::by_format);
      EXPECT_FALSE(header.absolute);
      EXPECT_TRUE(is_field_file(scratch / "f.dcm")) << kind;
      // Offsets of 250 mm in float have steps of 1.5e-5 mm.
      expect_corner(read_field_file(scratch / "f.dcm"), grid, matrices ? 5e-5 : 0, kind);
      EXPECT_TRUE(says(refusal([&] { read_forward_field(scratch / "f.dcm"); }),
                       {"a pull field where a forward field is expected", "f.dcm"}));
    }
  }
}

TEST(DicomField, PlastimatchsObjectHasTheVectorsThatItWasGiven) {
  const Scratch scratch;
  Geometry grid;
  grid.size = {6, 5, 7};
  grid.spacing = {1.5, 2, 2.5};
  grid.origin = {-4.5, 12, 30};
  write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
  write_image(scratch / "i.mha", AnyVolume(grid, VoxelType::i16).view());
  const std::string command = "cd '" + scratch.path().string() +
                              "' && plastimatch xf-convert --input f.mha --output-type vf --output-dicom d "
                              "--fixed-image i.mha --moving-image i.mha --dim '6 5 7' --origin '-4.5 12 30' "
                              "--spacing '1.5 2 2.5' --filenames-without-uids > log 2>&1";
  if (std::system(command.c_str()) != 0 || !std::filesystem::exists(scratch / "d/dro.dcm"))
    GTEST_SKIP() << "plastimatch is not installed";
  expect_corner(read_field_file(scratch / "d/dro.dcm"), grid, 0, "plastimatch");
  EXPECT_EQ(read_field_header(scratch / "d/dro.dcm").format, "DICOM Deformable Spatial Registration");
}

TEST(DicomField, ThirdAxisIsRowCrossColumn) {
  const Scratch scratch;
  MadeItem item;
  item.orientation = "1\\0\\0\\0\\0\\1";
  write_registration(scratch / "f.dcm", {item});
  const Geometry grid = read_field_header(scratch / "f.dcm").grid;
  EXPECT_EQ(grid.size, glm::i64vec3(4, 3, 2));
  EXPECT_EQ(grid.spacing, glm::dvec3(1.5, 2, 2.5));
  EXPECT_EQ(grid.origin, glm::dvec3(10, -20, 30));
  EXPECT_EQ(grid.direction, glm::dmat3(1, 0, 0, 0, 0, 1, 0, -1, 0));
}

TEST(DicomField, PreComesFirstThenTheOffsetThenPost) {
  const Scratch scratch;
  MadeItem item;
  item.position = "1\\2\\3";
  item.pre = "1\\0\\0\\10\\0\\1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1";   // 10 mm along x
  item.post = "0\\-2\\0\\0\\2\\0\\0\\0\\0\\0\\2\\1\\0\\0\\0\\1";  // a quarter about z, twice as large, 1 mm along z
  item.vectors[0] = 3;
  item.vectors[1] = 5;
  item.vectors[2] = 7;
  write_registration(scratch / "f.dcm", {item});
  const PullField field = read_pull_field(scratch / "f.dcm");
  // (1, 2, 3) + (10, 0, 0) + (3, 5, 7) = (14, 7, 10), which Post brings to (-14, 28, 21).
  EXPECT_EQ(field.displacement[0], glm::vec3(-14 - 1, 28 - 2, 21 - 3));
  // The next vertex (2.5, 2, 3), without an offset: (12.5, 2, 3) goes to (-4, 25, 7).
  EXPECT_EQ(field.displacement[1], glm::vec3(-4 - 2.5F, 25 - 2, 7 - 3));
}

TEST(DicomField, IdentityMatricesChangeNoBit) {
  const Scratch scratch;
  MadeItem item;
  const std::string identity = "1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1.0\\-0\\0\\0\\0\\1.000";
  for (std::size_t n = 0; n < item.vectors.size(); ++n) item.vectors[n] = 0.1F * static_cast<float>(n) - 3.3F;
  item.vectors[0] = -0.0F;
  item.vectors[1] = 1e-42F;
  item.vectors[2] = -3.4e38F;
  item.vectors[9] = item.vectors[10] = item.vectors[11] = NAN;
  for (const auto& [pre, post] : {std::pair(std::string(), std::string()), {identity, identity}, {identity, {}}}) {
    item.pre = pre;
    item.post = post;
    write_registration(scratch / "f.dcm", {item});
    const PullField field = read_pull_field(scratch / "f.dcm");
    ASSERT_EQ(field.displacement.size(), 24U);
    EXPECT_EQ(std::memcmp(field.displacement.data(), item.vectors.data(), 72 * sizeof(float)), 0);
    EXPECT_EQ(read_field_header(scratch / "f.dcm").format, "DICOM Deformable Spatial Registration");
  }
}

TEST(DicomField, UndefinedIsAWholeVectorOfNaN) {
  const Scratch scratch;
  MadeItem item;
  item.pre = "1\\0\\0\\10\\0\\1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1";
  item.vectors[9] = item.vectors[10] = item.vectors[11] = NAN;
  write_registration(scratch / "f.dcm", {item});
  const PullField field = read_pull_field(scratch / "f.dcm");
  EXPECT_TRUE(std::isnan(field.displacement[3].x) && std::isnan(field.displacement[3].y) &&
              std::isnan(field.displacement[3].z));
  EXPECT_EQ(field.displacement[4], glm::vec3(10, 0, 0));
  item.vectors[10] = 1;
  write_registration(scratch / "f.dcm", {item});
  EXPECT_TRUE(says(error_of(scratch / "f.dcm"), {"InputError: a vector of which only a part is NaN at vertex (3, 0, 0)",
                                                 "f.dcm", "expected all of it"}));
  item.vectors[9] = item.vectors[11] = 2;
  item.vectors[10] = -INFINITY;
  write_registration(scratch / "f.dcm", {item});
  EXPECT_TRUE(says(error_of(scratch / "f.dcm"), {"InputError: a displacement that is not finite", "(3, 0, 0), "}));
}

TEST(DicomField, OneOfSeveralItemsMustBeChosen) {
  const Scratch scratch;
  MadeItem first, matrices, third;
  first.source_frame = "1.2.40";
  first.vectors[0] = 1;
  matrices.source_frame = "1.2.41";
  matrices.has_grid = false;
  third.source_frame = "1.2.42";
  third.dimensions = {2, 3, 4};
  third.vectors[0] = 3;
  write_registration(scratch / "f.dcm", {first, matrices, third});
  EXPECT_TRUE(says(error_of(scratch / "f.dcm"), {"InputError: 2 items with a grid, ", "f.dcm:item=3",
                                                 "\n  1  from source frame of reference 1.2.40  4 x 3 x 2 vectors",
                                                 "\n  2  from source frame of reference 1.2.41  no grid",
                                                 "\n  3  from source frame of reference 1.2.42  2 x 3 x 4 vectors"}));
  EXPECT_EQ(read_field_file(item_of(scratch / "f.dcm", "1")).displacement[0], glm::vec3(1, 0, 0));
  EXPECT_EQ(read_field_file(item_of(scratch / "f.dcm", "3")).displacement[0], glm::vec3(3, 0, 0));
  EXPECT_EQ(read_field_header(item_of(scratch / "f.dcm", "3")).format,
            "DICOM Deformable Spatial Registration, item 3 of 3");
  for (const std::string wrong : {"2", "4", "99999999999"}) {
    EXPECT_TRUE(says(error_of(item_of(scratch / "f.dcm", wrong)),
                     {"InputError: no item " + wrong + " with a grid, ", "choose one of\n  1  from"}));
  }
  for (const std::string wrong : {"0", "-1", "1.5", "one", "999999999999999999999"}) {
    EXPECT_TRUE(says(refusal([&] { check_field_options(item_of(scratch / "f.dcm", wrong)); }),
                     {"InputError: item=" + wrong + ", ", "expected a whole number from 1"}));
  }
  EXPECT_TRUE(says(refusal([&] { check_field_options(parse_field_source((scratch / "f.dcm").string() + ":n=1")); }),
                   {"the option \"n\"", "expected item"}));
  write_registration(scratch / "f.dcm", {matrices, first});
  EXPECT_EQ(read_field_header(scratch / "f.dcm").format, "DICOM Deformable Spatial Registration, item 2 of 2");
  write_registration(scratch / "f.dcm", {matrices});
  EXPECT_TRUE(says(error_of(scratch / "f.dcm"), {"InputError: a registration by matrices alone, "}));
}

TEST(DicomField, OtherObjectsAreNoFields) {
  const Scratch scratch;
  write_slice(scratch / "ct.dcm", {});
  EXPECT_FALSE(is_field_file(scratch / "ct.dcm"));
  EXPECT_TRUE(says(error_of(scratch / "ct.dcm"),
                   {"InputError: no field but CTImageStorage (1.2.840.10008.5.1.4.1.1.2), ", "ct.dcm"}));
  write_registration(scratch / "rigid.dcm", {MadeItem()}, UID_SpatialRegistrationStorage);
  EXPECT_FALSE(is_field_file(scratch / "rigid.dcm"));
  EXPECT_TRUE(says(error_of(scratch / "rigid.dcm"), {"InputError: no field but SpatialRegistrationStorage"}));
  write_file(scratch / "short.dcm", std::string(128, '\0') + "DICM");
  EXPECT_FALSE(is_field_file(scratch / "short.dcm"));
  EXPECT_TRUE(error_of(scratch / "short.dcm").starts_with("InputError: ")) << error_of(scratch / "short.dcm");
}

TEST(DicomField, DamagedFilesAreRefusedByName) {
  const Scratch scratch;
  const auto path = scratch / "f.dcm";
  write_registration(path, {MadeItem()});
  const std::string good = read_bytes(path);
  ASSERT_EQ(error_of(path), "");
  const std::size_t values = good.size() - 288;  // the vectors come last, and lengths are explicit
  for (std::size_t n = 0; n < good.size(); ++n) {
    write_file(path, good.substr(0, n));
    const std::string text = error_of(path);
    ASSERT_TRUE(text.starts_with("InputError: ") && text.find(path.string()) != std::string::npos) << n << ": " << text;
  }
  expect_read_or_refused(good, values, path);
}

TEST(DicomField, ImpossibleValuesAreRefusedByName) {
  const Scratch scratch;
  const auto path = scratch / "f.dcm";
  const auto refused = [&](const std::string& why, const std::function<void(MadeItem&)>& change) {
    MadeItem item;
    change(item);
    write_registration(path, {item});
    EXPECT_TRUE(says(error_of(path), {"InputError: ", why, path.string()}));
  };
  const auto without = [](const DcmTagKey& tag) {
    return [tag](MadeItem& m) { m.edit_grid = [tag](DcmItem& grid) { grid.findAndDeleteElement(tag); }; };
  };
  refused("has 288 bytes", [](MadeItem& m) { m.dimensions = {4294967295, 4294967295, 4294967295}; });
  refused("a grid of 4 x 3 x 3 needs 12", [](MadeItem& m) { m.dimensions = {4, 3, 3}; });
  refused("has 284 bytes", [](MadeItem& m) { m.vectors.pop_back(); });
  refused("(0064,0007) GridDimensions of 0.0", [](MadeItem& m) { m.dimensions = {4, 0, 2}; });
  refused("2 values of (0064,0007)", [](MadeItem& m) { m.dimensions = {4, 6}; });
  refused("expected a positive number", [](MadeItem& m) { m.resolution = {1, -1, 1}; });
  refused("value 2 of (0064,0008)", [](MadeItem& m) { m.resolution = {1, NAN, 1}; });
  refused("of the grid is no rotation", [](MadeItem& m) { m.orientation = "1\\0\\0\\1\\0\\0"; });
  refused("of the grid is no rotation", [](MadeItem& m) { m.orientation = "2\\0\\0\\0\\1\\0"; });
  refused("5 values of (0020,0037)", [](MadeItem& m) { m.orientation = "1\\0\\0\\0\\1"; });
  refused("(0020,0032)", [](MadeItem& m) { m.position = "1\\here\\3"; });
  refused("is not 0 0 0 1", [](MadeItem& m) { m.post = "1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1\\0\\1\\0\\0\\1"; });
  refused("15 values of (3006,00c6)", [](MadeItem& m) { m.pre = "1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1\\0\\0\\0\\0"; });
  refused("no (0064,0009)", without(DCM_VectorGridData));
  refused("no (0064,0007)", without(DCM_GridDimensions));
  refused("no (0064,0008)", without(DCM_GridResolution));
  refused("no (0020,0032)", without(DCM_ImagePositionPatient));
  refused("of another kind than float", [](MadeItem& m) {
    m.edit_grid = [](DcmItem& grid) {
      const std::vector<Uint16> words(144, 0);
      auto* element = new DcmOtherByteOtherWord(DcmTag(DCM_VectorGridData, EVR_OW));
      element->putUint16Array(words.data(), words.size());
      grid.insert(element, OFTrue);
    };
  });
  write_registration(path, {});
  EXPECT_TRUE(says(error_of(path), {"InputError: no (0064,0002)", path.string()}));
}

TEST(DicomField, TwoGridsInOneItemAreRefused) {
  const Scratch scratch;
  MadeItem item;
  item.edit_grid = [](DcmItem& grid) {
    DcmItem* second = nullptr;
    grid.getParentItem()->findOrCreateSequenceItem(DCM_DeformableRegistrationGridSequence, second, -2);
  };
  write_registration(scratch / "f.dcm", {item});
  EXPECT_TRUE(says(error_of(scratch / "f.dcm"), {"InputError: 2 items of (0064,0005)", "expected one"}));
}

}  // namespace
}  // namespace tetwarp
