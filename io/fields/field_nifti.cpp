// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_nifti.h"

#include <array>
#include <cmath>

#include "deform/errors.h"
#include "io/fields/field_image.h"
#include "io/fields/shared/fsl_frame.h"
#include "io/fields/transform_niftyreg.h"
#include "io/images/nifti_file.h"
#include "io/ras.h"

namespace tetwarp {
namespace {

constexpr int kDisplacementVector = 1006, kVector = 1007;

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
  const std::string type = std::to_string(nifti.intent_p.x);
  require(nifti.intent_name == "NREG_TRANS" && nifti.intent_p.x >= 0 && nifti.intent_p.x < kNiftyRegRefused.size() &&
              nifti.intent_p.x == std::floor(nifti.intent_p.x),
          "a NiftyReg file of unknown kind (intent_name \"" + nifti.intent_name + "\", intent_p1 " + type + "), " +
              file + "; expected NREG_TRANS and 0 or 1");
  const char* refused = kNiftyRegRefused[static_cast<std::size_t>(nifti.intent_p.x)];
  require(refused == nullptr, std::string(refused ? refused : "") + " of NiftyReg (intent_p1 " + type + "), " + file +
                                  "; make a displacement field of it with reg_transform -disp");
  header.absolute = nifti.intent_p.x == 0;
  header.format = std::string("NIfTI, NiftyReg ") + (header.absolute ? "deformation field" : "displacement field");
  header.direction = Direction::pull;
  header.frame = "RAS";
  header.direction_basis = header.frame_basis = header.units_basis = FieldBasis::by_format;
  header.absolute_basis = FieldBasis::stated;
}

/// A deformation of SPM: positions in RAS mm (spm_dartel_norm and others, which write intent_name Mapping).
constexpr const char* kSpmName = "Mapping";

void describe_spm(FieldFileHeader& header) {
  header.format = "NIfTI, SPM deformation";
  header.absolute = true;
  header.direction = Direction::pull;
  header.frame = "RAS";
  header.direction_basis = header.frame_basis = header.units_basis = header.absolute_basis = FieldBasis::by_format;
}

/// Whether the file's intent states that it has vectors.
bool states_vectors(const NiftiHeader& nifti) {
  return nifti.intent_code == kDisplacementVector || nifti.intent_code == kVector;
}

/// Refuses vectors of which neither the file nor the options say what they are.
/// @throws InputError with the options to give
void require_declared(const NiftiHeader& nifti, const FieldSource& source) {
  const std::string file = source.path.string();
  const bool values = source.options.contains("values");
  if (is_fsl_field(nifti.intent_code)) {
    require(values && source.options.contains("source"),
            "a field of FSL leads into its moving image, and does not say whether it holds displacements (relative) or "
            "positions (absolute), " +
                file + "; give both: " + file + ":values=displacements|positions,source=MOVING");
    return;
  }
  const bool as_volumes = nifti.dim[0] == 4 && nifti.dim[4] == 3;
  const bool unstated = nifti.dim[0] >= 5 && nifti.dim[4] == 1 && nifti.dim[5] == 3 && !states_vectors(nifti);
  require((!as_volumes && !unstated) || (values && source.options.contains("frame")),
          "vectors that the file does not state to be some, " + file + "; give " + file +
              ":values=displacements|positions,frame=lps|ras");
}

/// A field of FSL, from the coordinates of its own grid to those of the source image, in either form.
void describe_fsl(FieldFileHeader& header) {
  header.format = "NIfTI, FSL field (intent 2006)";
  header.direction = Direction::pull;
  header.frame = "FSL";
  header.direction_basis = header.frame_basis = header.units_basis = FieldBasis::by_format;
}

/// Takes what the options say. @throws InputError where the format says otherwise
void take_options(const FieldSource& source, FieldFileHeader& header) {
  const std::string file = source.path.string(), values = source.option("values");
  const bool positions = values == "positions";
  require(values.empty() || header.absolute_basis == FieldBasis::assumed || positions == header.absolute,
          "values=" + values + ", but " + header.format + " holds " +
              (header.absolute ? "positions" : "displacements") + ", " + file);
  if (!values.empty() && header.absolute_basis == FieldBasis::assumed) {
    header.absolute = positions;
    header.absolute_basis = FieldBasis::by_option;
  }
  if (!source.options.contains("frame")) return;
  const std::string frame = source.option("frame") == "ras" ? "RAS" : "LPS";
  require(header.frame_basis == FieldBasis::assumed || header.frame == frame,
          "frame=" + source.option("frame") + ", but the vectors of " + header.format + " are in " + header.frame +
              ", " + file);
  if (header.frame_basis != FieldBasis::assumed) return;
  header.frame = frame;
  header.frame_basis = FieldBasis::by_option;
}

void describe_displacement_vectors(const NiftiHeader& nifti, FieldFileHeader& header) {
  header.format = "NIfTI, intent 1006 (DISPVECT)";
  header.frame = "RAS";
  header.frame_basis = header.absolute_basis = FieldBasis::by_format;
  header.units_basis = nifti.units != 0 ? FieldBasis::stated : FieldBasis::assumed;
}

class NiftiFieldReader final : public FieldReader {
 public:
  /// @param fsl_source  grid of the moving image, of a field of FSL
  NiftiFieldReader(FieldFileHeader header, std::unique_ptr<ImageReader> image,
                   const std::optional<Geometry>& fsl_source)
      : FieldReader(std::move(header)), image_(std::move(image)) {
    if (!fsl_source) return;
    fsl_from_point_ = fsl_from_lps(header_.grid);
    point_from_fsl_ = lps_from_fsl(*fsl_source);
  }

  void read(std::span<glm::vec3> displacement) const override {
    if (header_.frame == "LPS" && !header_.absolute) return read_vectors(*image_, displacement);
    const AffineMap point = point_from_index(header_.grid);
    const glm::i64vec3 size = header_.grid.size;
    read_vectors(*image_, displacement, [&](const glm::dvec3& vector, std::size_t vertex) {
      const auto n = static_cast<std::int64_t>(vertex);
      const glm::dvec3 at = point(glm::dvec3(n % size.x, n / size.x % size.y, n / (size.x * size.y)));
      return in_lps(vector, at) - (header_.absolute || header_.frame == "FSL" ? at : glm::dvec3(0)) + 0.0;  // no -0
    });
  }

 private:
  /// A vector in LPS mm; of FSL always a position. Infinity times zero would give NaN, so an infinite one stays.
  glm::dvec3 in_lps(const glm::dvec3& vector, const glm::dvec3& at) const {
    if (header_.frame == "RAS") return kLpsFromRas * vector;
    if (header_.frame == "LPS" || std::isinf(vector.x) || std::isinf(vector.y) || std::isinf(vector.z)) return vector;
    return point_from_fsl_(header_.absolute ? vector : fsl_from_point_(at) + vector);
  }

  std::unique_ptr<ImageReader> image_;
  AffineMap fsl_from_point_, point_from_fsl_;
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return image_format(path) == ImageFormat::nifti;
}

/// Which frame of a NIfTI file to use: NiftyReg uses the sform where there is one, whatever its code, so its files are
/// read like this whatever the user chose.
NiftiFrame frame_of(const FieldSource& source, const NiftiHeader& nifti) {
  return nifti.intent_name.starts_with("NREG_") ? NiftiFrame::sform : source.nifti_frame;
}

/// A file whose vectors are volumes is taken for a field only where something says that it is one: three volumes may be
/// three times as well.
NiftiVectors vectors_of(const FieldSource& source) {
  return source.options.empty() ? NiftiVectors::stated : NiftiVectors::declared;
}

bool holds_field(const FieldSource& source) {
  const NiftiHeader nifti = read_nifti_header(source.path, NiftiVectors::declared);
  if (is_fsl_field(nifti.intent_code)) return true;
  if (is_fsl_coefficients(nifti.intent_code)) return false;
  const ImageHeader header = open_image(source.path, frame_of(source, nifti), vectors_of(source))->header();
  return header.components == 3 && !is_niftyreg_spline(nifti);
}

void check_options(const FieldSource& source) {
  const std::string file = source.path.string();
  for (const auto& [key, value] : source.options) {
    const bool values = key == "values", frame = key == "frame";
    require(values || frame || key == "source",
            "the option \"" + key + "\", " + file + "; expected values, frame or source");
    require(!values || value == "displacements" || value == "positions",
            "values=" + value + ", " + file + "; expected displacements or positions");
    require(!frame || value == "lps" || value == "ras", "frame=" + value + ", " + file + "; expected lps or ras");
  }
  NiftiHeader nifti;
  try {
    nifti = read_nifti_header(source.path, NiftiVectors::declared);
  } catch (const InputError&) {
    return;  // whoever reads the file says what is wrong with it
  }
  require_declared(nifti, source);
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  const std::string file = source.path.string();
  const NiftiHeader nifti = read_nifti_header(source.path, NiftiVectors::declared);
  const bool fsl = is_fsl_field(nifti.intent_code);
  require(!is_fsl_coefficients(nifti.intent_code), "coefficients of fnirt, " + file + ", are a transform, no field");
  require(fsl || !source.options.contains("source"), "source=, " + file + ": only the fields of FSL need that image");
  require_declared(nifti, source);
  FieldFileHeader header;
  header.format = "NIfTI, intent 1007 (VECTOR)";
  if (fsl) describe_fsl(header);
  auto image = open_vectors(source.path, frame_of(source, nifti), fsl ? NiftiVectors::declared : vectors_of(source));
  header.notes = image->header().notes;
  header.grid = image->header().geometry;
  if (nifti.intent_name.starts_with("NREG_")) {
    describe_niftyreg(nifti, file, header);
  } else if (nifti.intent_name == kSpmName) {
    describe_spm(header);
  } else if (!fsl) {
    read_stated_direction(image->header(), file, header);
    if (nifti.intent_code == kDisplacementVector) describe_displacement_vectors(nifti, header);
    if (nifti.dim[0] == 4) header.format = "NIfTI, vectors as volumes";
    if (nifti.dim[0] > 4 && !states_vectors(nifti)) header.format = "NIfTI, vectors without an intent";
  }
  take_options(source, header);
  std::optional<Geometry> fsl_source;
  if (fsl) fsl_source = read_image_header(source.option("source"), source.nifti_frame).geometry;
  return std::make_unique<NiftiFieldReader>(std::move(header), std::move(image), fsl_source);
}

}  // namespace

const FieldFormat kFieldFormat_nifti = {recognizes, holds_field, check_options, open};

}  // namespace tetwarp
