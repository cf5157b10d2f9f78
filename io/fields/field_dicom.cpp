// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_dicom.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "deform/errors.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/fields/shared/registration_item.h"
#include "io/images/image_reader.h"

namespace tetwarp {
namespace {

/// The grid of the vectors (C.20.3.1.1). Its third axis is row x column, whatever the patient's axes are.
Geometry grid_of(const RegistrationValues& values) {
  const std::vector<double> position = values.numbers(DCM_ImagePositionPatient, 3),
                            cosines = values.numbers(DCM_ImageOrientationPatient, 6),
                            size = values.numbers(DCM_GridDimensions, 3),
                            resolution = values.numbers(DCM_GridResolution, 3);
  const glm::dvec3 row(cosines[0], cosines[1], cosines[2]), column(cosines[3], cosines[4], cosines[5]);
  const bool is_rotation = std::abs(glm::length(row) - 1) <= 1e-3 && std::abs(glm::length(column) - 1) <= 1e-3 &&
                           // Cosines of three digits are round-off, as for slices.
                           std::abs(glm::dot(row, column)) <= 1e-3;
  require(is_rotation, tag_name(DCM_ImageOrientationPatient) + " of the grid is no rotation, " + values.file() +
                           "; expected two unit vectors at a right angle");
  for (const double value : size) {
    require(value >= 1 && value == std::floor(value) && value <= std::numeric_limits<Uint32>::max(),
            tag_name(DCM_GridDimensions) + " of " + std::to_string(value) + ", " + values.file() +
                "; expected whole numbers from 1");
  }
  Geometry grid;
  grid.size = {static_cast<std::int64_t>(size[0]), static_cast<std::int64_t>(size[1]),
               static_cast<std::int64_t>(size[2])};
  grid.spacing = {resolution[0], resolution[1], resolution[2]};
  grid.origin = {position[0], position[1], position[2]};
  grid.direction = glm::dmat3(row, column, glm::cross(row, column));
  require_valid(grid, "the deformation grid of " + values.file());
  return grid;
}

bool is_identity(const AffineMap& map) { return map.linear == glm::dmat3(1) && map.offset == glm::dvec3(0); }

// --- the file

class RegistrationFile {
 public:
  explicit RegistrationFile(const std::filesystem::path& path) : file_(path.string()) {
    prepare_dcmtk();
    const OFCondition read = parse_dicom(format_, path, DCM_UndefinedTagKey).result;
    require(read.good(), std::string("cannot be read as DICOM (") + read.text() + "), " + file_ + "; is it whole?");
    const std::string kind = text_of(*format_.getDataset(), DCM_SOPClassUID);
    require(kind == UID_DeformableSpatialRegistrationStorage,
            "no field but " + (kind.empty() ? "an object without a SOP class" : uid_with_name(kind)) + ", " + file_ +
                "; of DICOM a Deformable Spatial Registration is expected");
    format_.getDataset()->findAndGetSequence(DCM_DeformableRegistrationSequence, items_);
    require(items_ != nullptr && items_->card() > 0,
            "no " + tag_name(DCM_DeformableRegistrationSequence) + ", " + file_ + "; is the file whole?");
  }

  std::size_t count() { return items_->card(); }
  DcmItem& item(std::size_t n) { return *items_->getItem(static_cast<unsigned long>(n - 1)); }
  DcmItem* grid(std::size_t n) { return only_item(item(n), DCM_DeformableRegistrationGridSequence, file_); }

  /// The number of the item to read. @param wanted  0: the only one with a grid
  std::size_t choose(std::size_t wanted) {
    std::size_t with_grid = 0, last = 0;
    for (std::size_t n = 1; n <= count(); ++n) {
      if (grid(n) == nullptr) continue;
      ++with_grid;
      last = n;
    }
    require(with_grid > 0, "a registration by matrices alone, " + file_ + "; a field needs a " +
                               tag_name(DCM_DeformableRegistrationGridSequence));
    if (wanted == 0) {
      require(with_grid == 1, std::to_string(with_grid) + " items with a grid, " + file_ +
                                  "; choose one with item=N: " + file_ + ":item=" + std::to_string(last) + list());
      return last;
    }
    require(wanted <= count() && grid(wanted) != nullptr,
            "no item " + std::to_string(wanted) + " with a grid, " + file_ + "; choose one of" + list());
    return wanted;
  }

 private:
  std::string list() {
    std::string lines;
    for (std::size_t n = 1; n <= count(); ++n) {
      DcmItem* const found = grid(n);
      std::string size = found ? text_of(*found, DCM_GridDimensions) : "";
      for (std::size_t at = 0; (at = size.find('\\', at)) != std::string::npos;) size.replace(at, 1, " x ");
      lines += "\n  " + std::to_string(n) + "  from source frame of reference " +
               text_of(item(n), DCM_SourceFrameOfReferenceUID) + "  " + (found ? size + " vectors" : "no grid");
    }
    return lines;
  }

  std::string file_;
  DcmFileFormat format_;
  DcmSequenceOfItems* items_ = nullptr;
};

// --- the field

/// Vector Grid Data (C.20.3.1.3): three floats a vector, i fastest, one vector for each vertex of the grid.
DcmElement& vectors_of(DcmItem& grid, const Geometry& geometry, const std::string& file) {
  DcmElement* element = nullptr;
  grid.findAndGetElement(DCM_VectorGridData, element);
  const std::string name = tag_name(DCM_VectorGridData);
  require(element != nullptr, "no " + name + ", " + file + "; is the file whole?");
  require(element->ident() == EVR_OF, name + " of another kind than float (VR OF), " + file);
  const double expected = 12.0 * static_cast<double>(geometry.size.x) * static_cast<double>(geometry.size.y) *
                          static_cast<double>(geometry.size.z);
  require(static_cast<double>(element->getLength()) == expected,
          name + " has " + std::to_string(element->getLength()) + " bytes, " + file + "; a grid of " +
              to_string(geometry.size) + " needs 12 for each vector");
  return *element;
}

/// Reads the displacements of a registration. For a point x of the grid the source point is Post(Pre(x) + offset)
/// (C.20.3.1.1), so the displacement is Post(Pre(x)) - x + Post.linear * offset.
class RegistrationReader final : public FieldReader {
 public:
  RegistrationReader(FieldFileHeader header, std::string name, std::unique_ptr<RegistrationFile> file,
                     DcmElement& vectors, const AffineMap& pre, const AffineMap& post)
      : FieldReader(std::move(header)),
        name_(std::move(name)),
        file_(std::move(file)),
        vectors_(vectors),
        from_vector_(post.linear),
        identity_(is_identity(pre) && is_identity(post)) {
    const AffineMap both = post * pre;
    from_point_ = {both.linear - glm::dmat3(1), both.offset};
  }

  void read(std::span<glm::vec3> displacement) const override {
    const OFCondition read =
        vectors_.getPartialValue(displacement.data(), 0, static_cast<Uint32>(displacement.size_bytes()));
    require(read.good(), std::string("truncated vectors (") + read.text() + "), " + name_ + "; is the file whole?");
    const AffineMap point = point_from_index(header_.grid);
    const glm::i64vec3 size = header_.grid.size;
    for (std::size_t v = 0; v < displacement.size(); ++v) {
      glm::vec3& d = displacement[v];
      const auto n = static_cast<std::int64_t>(v);
      const glm::i64vec3 at(n % size.x, n / size.x % size.y, n / (size.x * size.y));
      const int missing = std::isnan(d.x) + std::isnan(d.y) + std::isnan(d.z);
      require(missing == 0 || missing == 3, "a vector of which only a part is NaN at vertex (" + std::to_string(at.x) +
                                                ", " + std::to_string(at.y) + ", " + std::to_string(at.z) + "), " +
                                                name_ + "; expected all of it (undefined) or nothing");
      if (identity_ || !std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z)) continue;
      d = glm::vec3(from_point_(point(glm::dvec3(at))) + from_vector_ * glm::dvec3(d));
    }
  }

 private:
  std::string name_;
  std::unique_ptr<RegistrationFile> file_;  // owns `vectors_`
  DcmElement& vectors_;
  AffineMap from_point_;    // from a point x of the grid to Post(Pre(x)) - x
  glm::dmat3 from_vector_;  // from an offset to its part of the displacement: Post.linear
  bool identity_;           // both maps are identities, so the offsets are the displacements
};

// --- the format

bool recognizes(const std::filesystem::path&, std::string_view first_bytes) { return is_marked_dicom(first_bytes); }

bool holds_field(const FieldSource& source) {
  return is_of_class(source.path, UID_DeformableSpatialRegistrationStorage);
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  require_readable_file(source.path);
  const std::string name = source.path.string();
  auto file = std::make_unique<RegistrationFile>(source.path);
  const std::size_t number = file->choose(registration_item(source));
  DcmItem& item = file->item(number);
  DcmItem& grid = *file->grid(number);
  const AffineMap pre = matrix_in(item, DCM_PreDeformationMatrixRegistrationSequence, name),
                  post = matrix_in(item, DCM_PostDeformationMatrixRegistrationSequence, name);
  FieldFileHeader header;
  header.grid = grid_of(RegistrationValues(grid, name));
  header.format = "DICOM Deformable Spatial Registration";
  if (file->count() > 1) header.format += ", item " + std::to_string(number) + " of " + std::to_string(file->count());
  if (!is_identity(pre) || !is_identity(post)) header.format += ", with its matrices";
  header.direction = Direction::pull;
  header.direction_basis = header.frame_basis = header.units_basis = header.absolute_basis = FieldBasis::by_format;
  DcmElement& vectors = vectors_of(grid, header.grid, name);
  return std::make_unique<RegistrationReader>(std::move(header), name, std::move(file), vectors, pre, post);
}

}  // namespace

const FieldFormat kFieldFormat_dicom = {recognizes, holds_field, check_registration_options, open};

}  // namespace tetwarp
