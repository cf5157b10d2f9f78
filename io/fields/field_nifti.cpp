// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_nifti.h"

#include <array>
#include <cmath>

#include "deform/errors.h"
#include "io/fields/field_image.h"
#include "io/fields/niftyreg_spline.h"
#include "io/images/nifti_file.h"

namespace tetwarp {
namespace {

constexpr int kDisplacementVector = 1006;
constexpr glm::dvec3 kLpsFromRas(-1, -1, 1);

/// What is refused, by the type of a NiftyReg file (reg-lib/cpu/_reg_maths.h, NREG_TRANS_TYPE, which intent_p1 holds):
/// the name of a type that cannot be read, null for one that can.
constexpr std::array<const char*, 7> kNiftyRegRefused = {nullptr,
                                                         nullptr,
                                                         "a cubic B-spline control point grid",
                                                         "a velocity field of positions",
                                                         "a velocity field of displacements",
                                                         "a velocity control point grid",
                                                         "a linear B-spline control point grid"};

void describe_niftyreg(const NiftiHeader& nifti, const std::string& file, FieldFileHeader& header) {
  const std::string type = std::to_string(nifti.intent_p1);
  require(nifti.intent_name == "NREG_TRANS" && nifti.intent_p1 >= 0 && nifti.intent_p1 < kNiftyRegRefused.size() &&
              nifti.intent_p1 == std::floor(nifti.intent_p1),
          "a NiftyReg file of unknown kind (intent_name \"" + nifti.intent_name + "\", intent_p1 " + type + "), " +
              file + "; expected NREG_TRANS and 0 or 1");
  const char* refused = kNiftyRegRefused[static_cast<std::size_t>(nifti.intent_p1)];
  require(refused == nullptr, std::string(refused ? refused : "") + " of NiftyReg (intent_p1 " + type + "), " + file +
                                  "; make a displacement field of it with reg_transform -disp");
  header.absolute = nifti.intent_p1 == 0;
  header.format = std::string("NIfTI, NiftyReg ") + (header.absolute ? "deformation field" : "displacement field");
  header.direction = Direction::pull;
  header.frame = "RAS";
  header.direction_basis = header.frame_basis = header.units_basis = FieldBasis::by_format;
  header.absolute_basis = FieldBasis::stated;
}

void describe_displacement_vectors(const NiftiHeader& nifti, FieldFileHeader& header) {
  header.format = "NIfTI, intent 1006 (DISPVECT)";
  header.frame = "RAS";
  header.frame_basis = header.absolute_basis = FieldBasis::by_format;
  header.units_basis = nifti.units != 0 ? FieldBasis::stated : FieldBasis::assumed;
}

class NiftiFieldReader final : public FieldReader {
 public:
  NiftiFieldReader(FieldFileHeader header, std::unique_ptr<ImageReader> image)
      : FieldReader(std::move(header)), image_(std::move(image)) {}

  void read(std::span<glm::vec3> displacement) const override {
    if (header_.frame == "LPS") return read_vectors(*image_, displacement);
    if (!header_.absolute) {
      return read_vectors(*image_, displacement,
                          // + 0.0 makes 0 of -0
                          [](const glm::dvec3& vector, std::size_t) { return kLpsFromRas * vector + 0.0; });
    }
    const AffineMap point = point_from_index(header_.grid);
    const glm::i64vec3 size = header_.grid.size;
    read_vectors(*image_, displacement, [&](const glm::dvec3& vector, std::size_t vertex) {
      const auto n = static_cast<std::int64_t>(vertex);
      return kLpsFromRas * vector - point(glm::dvec3(n % size.x, n / size.x % size.y, n / (size.x * size.y))) + 0.0;
    });
  }

 private:
  std::unique_ptr<ImageReader> image_;
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return image_format(path) == ImageFormat::nifti;
}

/// Which frame of a NIfTI file to use: NiftyReg uses the sform where there is one, whatever its code, so its files are
/// read like this whatever the user chose.
NiftiFrame frame_of(const FieldSource& source, const NiftiHeader& nifti) {
  return nifti.intent_name.starts_with("NREG_") ? NiftiFrame::sform : source.nifti_frame;
}

bool holds_field(const FieldSource& source) {
  const NiftiHeader nifti = read_nifti_header(source.path);
  return read_image_header(source.path, frame_of(source, nifti)).components == 3 && !is_niftyreg_spline(nifti);
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  const std::string file = source.path.string();
  const NiftiHeader nifti = read_nifti_header(source.path);
  auto image = open_vectors(source.path, frame_of(source, nifti));
  FieldFileHeader header;
  header.notes = image->header().notes;
  header.grid = image->header().geometry;
  header.format = "NIfTI, intent 1007 (VECTOR)";
  if (nifti.intent_name.starts_with("NREG_")) {
    describe_niftyreg(nifti, file, header);
  } else {
    read_stated_direction(image->header(), file, header);
    if (nifti.intent_code == kDisplacementVector) describe_displacement_vectors(nifti, header);
  }
  return std::make_unique<NiftiFieldReader>(std::move(header), std::move(image));
}

}  // namespace

const FieldFormat kFieldFormat_nifti = {recognizes, holds_field, nullptr, open};

}  // namespace tetwarp
