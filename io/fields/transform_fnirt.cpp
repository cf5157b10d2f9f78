// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/transform_fnirt.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>

#include "deform/errors.h"
#include "io/fields/field_image.h"
#include "io/fields/shared/cubic_spline.h"
#include "io/fields/shared/fsl_frame.h"
#include "io/images/nifti_file.h"
#include "io/opened_file.h"
#include "io/ras.h"

namespace tetwarp {
namespace {

constexpr int kCubic = 2007, kCosine = 2008;  // intent codes of FSL

/// Two images, in whose coordinates the spline is (fsl/transform/fnirt.py of fslpy, fnirt_file_writer.cpp of FSL). For
/// a point p of the reference, in FSL's coordinates, the source is taken at A p + d(p): A is the inverse of the
/// affine map from source to reference, which the sform holds, and d the spline over the reference's voxels.
struct Coefficients {
  CubicSpline spline;
  glm::dvec3 knots;                 ///< voxels of the reference from one control point to the next, along each axis
  AffineMap source_from_reference;  ///< A
  glm::i64vec3 size;                ///< of the reference, in voxels
  glm::dvec3 spacing;               ///< of the reference, mm
};

/// The size that a coordinate of the qform's offset states.
std::int64_t size_in(double offset) { return std::abs(offset) < 1e6 ? std::llround(offset) : 0; }

Coefficients read_coefficients(const std::filesystem::path& path) {
  const std::string file = path.string();
  const NiftiHeader nifti = read_nifti_header(path, NiftiVectors::declared);
  require(nifti.intent_code == kCubic,
          std::string(nifti.intent_code == kCosine ? "cosine" : "quadratic") + " coefficients of fnirt (intent code " +
              std::to_string(nifti.intent_code) + "), " + file +
              "; only cubic ones are read: make a field of them with fnirtfileutils --out");
  require(nifti.qform_code > 0 && nifti.sform_code > 0,
          "coefficients of fnirt without qform or sform, " + file + ", which hold the reference and its affine map");
  Coefficients result;
  // The qform alone places the coefficients, for the sform is another map.
  const auto image = open_vectors(path, NiftiFrame::qform, NiftiVectors::declared);
  result.spline.size = image->header().geometry.size;
  result.spline.control = read_double_vectors(*image);
  result.spline.beyond = CubicSpline::Beyond::zero;
  for (const glm::dvec3& vector : result.spline.control)
    require(glm::length(vector) < 1e9, "a coefficient that is not finite, or beyond 1e9 mm, " + file);
  result.knots = nifti.pixdim;
  const glm::dvec3 offset = kLpsFromRas * nifti.qform.origin;
  result.size = {size_in(offset.x), size_in(offset.y), size_in(offset.z)};
  result.spacing = nifti.intent_p;
  AffineMap reference_from_source = point_from_index(nifti.sform);
  for (int column = 0; column < 3; ++column) reference_from_source.linear[column] *= kLpsFromRas;
  reference_from_source.offset *= kLpsFromRas;
  require(std::abs(glm::determinant(reference_from_source.linear)) > 1e-9,
          "an affine map without an inverse in the sform, " + file);
  result.source_from_reference = inverse_of(reference_from_source);
  return result;
}

std::string text_of(const glm::dvec3& mm) {
  return std::to_string(mm.x) + " x " + std::to_string(mm.y) + " x " + std::to_string(mm.z) + " mm";
}

/// @throws InputError unless the reference is the image for which the coefficients were made
void require_reference(const Coefficients& coefficients, const Geometry& reference, const FieldSource& source) {
  const glm::dvec3 apart = glm::abs(reference.spacing - coefficients.spacing);
  require(reference.size == coefficients.size && glm::all(glm::lessThan(apart, 1e-4 * reference.spacing)), [&] {
    return "coefficients for a reference of " + to_string(coefficients.size) + " voxels of " +
           text_of(coefficients.spacing) + ", " + source.path.string() + ", but " + source.option("reference") +
           " has " + to_string(reference.size) + " of " + text_of(reference.spacing);
  });
}

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return image_format(path) == ImageFormat::nifti;
}

bool holds_transform(const std::filesystem::path& path) {
  try {
    return is_file(path) && is_fsl_coefficients(read_nifti_header(path, NiftiVectors::declared).intent_code);
  } catch (const InputError&) {
    return false;  // refused with a reason when it is read as a volume or a field
  }
}

void check_options(const FieldSource& source) {
  const std::string file = source.path.string();
  for (const auto& [key, value] : source.options) {
    require(key == "source" || key == "reference",
            "the option \"" + key + "\", " + file + "; expected source and reference");
  }
  require(source.options.contains("source") && source.options.contains("reference"),
          "coefficients of fnirt lead between two images, " + file + "; give both: " + file +
              ":source=MOVING,reference=FIXED");
}

TransformFile read(const FieldSource& source, const std::stop_token&) {
  const auto coefficients = std::make_shared<const Coefficients>(read_coefficients(source.path));
  const auto geometry = [&](const char* key) {
    return read_image_header(source.option(key), source.nifti_frame).geometry;
  };
  const Geometry moving = geometry("source"), fixed = geometry("reference");
  require_reference(*coefficients, fixed, source);
  TransformFile result;
  result.tool = "FSL fnirt";
  result.classes = {"cubic B-spline of " + to_string(coefficients->spline.size) + " coefficients"};
  result.parameters = 3 * coefficients->spline.control.size();
  result.direction = Direction::pull;
  result.frame = "FSL";
  result.beyond = "where the affine map alone leads them";
  result.outside = std::make_shared<std::atomic<std::uint64_t>>(0);
  const AffineMap to_voxel = index_from_point(fixed), to_fsl = fsl_from_lps(fixed), from_fsl = lps_from_fsl(moving);
  const glm::dvec3 last(fixed.size - std::int64_t{1});
  result.displacement = [=, outside = result.outside](const glm::dvec3& point) {
    constexpr double kRounding = 1e-3;  // of a voxel
    const glm::dvec3 voxel = to_voxel(point);
    if (glm::clamp(voxel, glm::dvec3(-kRounding), last + kRounding) != voxel)
      outside->fetch_add(1, std::memory_order_relaxed);
    // The first coefficient stands one knot before the first voxel.
    const glm::dvec3 by = coefficients->spline.at(voxel / coefficients->knots + 1.0);
    return from_fsl(coefficients->source_from_reference(to_fsl(point)) + by) - point;
  };
  return result;
}

void add_files(const FieldSource& source, std::vector<std::filesystem::path>& files) {
  for (const char* key : {"source", "reference"}) {
    if (source.options.contains(key)) files.emplace_back(source.option(key));
  }
}

}  // namespace

const TransformFormat kTransformFormat_fnirt = {recognizes, holds_transform, check_options, read, add_files};

}  // namespace tetwarp
