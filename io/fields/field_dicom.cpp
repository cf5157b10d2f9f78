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
#include "io/images/image_reader.h"

namespace tetwarp {
namespace {

constexpr std::size_t kMagicOffset = 128;
constexpr std::string_view kMagic = "DICM";

// --- values of one item

class Values {
 public:
  Values(DcmItem& item, std::string file) : item_(item), file_(std::move(file)) {}

  /// The numbers of an attribute. @throws InputError unless there are `count` of them, all finite
  std::vector<double> numbers(const DcmTagKey& tag, unsigned long count) const {
    DcmElement* element = nullptr;
    require(item_.findAndGetElement(tag, element).good() && element != nullptr,
            "no " + tag_name(tag) + ", " + file_ + "; is the file whole?");
    require(element->getVM() == count, std::to_string(element->getVM()) + " values of " + tag_name(tag) + ", " + file_ +
                                           "; expected " + std::to_string(count));
    std::vector<double> values(count);
    for (unsigned long n = 0; n < count; ++n) {
      values[n] = number(tag, n);
      require(std::isfinite(values[n]), [&] {
        return "value " + std::to_string(n + 1) + " of " + tag_name(tag) + " is no finite number, " + file_ +
               "; expected one";
      });
    }
    return values;
  }

  const std::string& file() const { return file_; }

 private:
  /// One number of an attribute; NaN where it cannot be read. Grid Dimensions are of VR UL, which DCMTK does not give
  /// as Float64.
  double number(const DcmTagKey& tag, unsigned long n) const {
    double value = 0;
    if (item_.findAndGetFloat64(tag, value, n).good()) return value;
    Uint32 whole = 0;
    return item_.findAndGetUint32(tag, whole, n).good() ? whole : std::numeric_limits<double>::quiet_NaN();
  }

  DcmItem& item_;
  std::string file_;
};

/// The only item of a sequence; null: it has none. @throws InputError for several items
DcmItem* only_item(DcmItem& item, const DcmTagKey& tag, const std::string& file) {
  DcmSequenceOfItems* sequence = nullptr;
  if (item.findAndGetSequence(tag, sequence).bad() || sequence == nullptr || sequence->card() == 0) return nullptr;
  require(sequence->card() == 1,
          std::to_string(sequence->card()) + " items of " + tag_name(tag) + ", " + file + "; expected one");
  return sequence->getItem(0);
}

/// The grid of the vectors (C.20.3.1.1). Its third axis is row x column, whatever the patient's axes are.
Geometry grid_of(const Values& values) {
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

/// The matrix of a Matrix Registration Sequence (C.20.2.1.1, row by row); the identity where there is none.
AffineMap matrix_of(DcmItem& item, const DcmTagKey& sequence, const std::string& file) {
  DcmItem* only = only_item(item, sequence, file);
  if (only == nullptr) return {};
  const std::vector<double> m = Values(*only, file).numbers(DCM_FrameOfReferenceTransformationMatrix, 16);
  require(m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1,
          "the last row of the matrix of " + tag_name(sequence) + " is not 0 0 0 1, " + file);
  return {glm::dmat3(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]), {m[3], m[7], m[11]}};
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

/// The item that the option names; 0: the option is not given. @throws InputError for what is no number from 1 up
std::size_t wanted_item(const FieldSource& source) {
  const auto found = source.options.find("item");
  if (found == source.options.end()) return 0;
  const std::string& text = found->second;
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  require(error == std::errc() && end == text.data() + text.size() && number >= 1,
          "item=" + text + ", " + source.path.string() + "; expected a whole number from 1");
  return number;
}

void check_options(const FieldSource& source) {
  for (const auto& [key, value] : source.options)
    require(key == "item", "the option \"" + key + "\", " + source.path.string() + "; expected item");
  wanted_item(source);
}

bool recognizes(const std::filesystem::path&, std::string_view first_bytes) {
  return first_bytes.substr(std::min(kMagicOffset, first_bytes.size())).starts_with(kMagic);
}

bool holds_field(const FieldSource& source) {
  prepare_dcmtk();
  DcmFileFormat format;
  return parse_dicom(format, source.path, DCM_StudyDate).result.good() &&
         text_of(*format.getDataset(), DCM_SOPClassUID) == UID_DeformableSpatialRegistrationStorage;
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  require_readable_file(source.path);
  const std::string name = source.path.string();
  auto file = std::make_unique<RegistrationFile>(source.path);
  const std::size_t number = file->choose(wanted_item(source));
  DcmItem& item = file->item(number);
  DcmItem& grid = *file->grid(number);
  const AffineMap pre = matrix_of(item, DCM_PreDeformationMatrixRegistrationSequence, name),
                  post = matrix_of(item, DCM_PostDeformationMatrixRegistrationSequence, name);
  FieldFileHeader header;
  header.grid = grid_of(Values(grid, name));
  header.format = "DICOM Deformable Spatial Registration";
  if (file->count() > 1) header.format += ", item " + std::to_string(number) + " of " + std::to_string(file->count());
  if (!is_identity(pre) || !is_identity(post)) header.format += ", with its matrices";
  header.direction = Direction::pull;
  header.direction_basis = header.frame_basis = header.units_basis = header.absolute_basis = FieldBasis::by_format;
  DcmElement& vectors = vectors_of(grid, header.grid, name);
  return std::make_unique<RegistrationReader>(std::move(header), name, std::move(file), vectors, pre, post);
}

}  // namespace

const FieldFormat kFieldFormat_dicom = {recognizes, holds_field, check_options, open};

}  // namespace tetwarp
