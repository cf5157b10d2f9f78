// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/transform_niftyreg.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>

#include "deform/errors.h"
#include "io/fields/field_image.h"
#include "io/fields/shared/cubic_spline.h"
#include "io/images/image_reader.h"
#include "io/opened_file.h"
#include "io/ras.h"

namespace tetwarp {
namespace {

constexpr double kFirstByte = 352;  // where values begin in a file without header extensions
// Part of the distance of control points: the floats of the header may put the border of the image so far outside.
constexpr double kRounding = 1e-3;

struct ControlPoints {
  Geometry grid;
  // LPS mm. Displacements are blended, not positions: the B-spline of positions at rest is the identity, so both give
  // the same.
  CubicSpline displacement;
};

ControlPoints read_control_points(const std::filesystem::path& path) {
  const std::string file = path.string();
  const auto image = open_vectors(path);  // also checks that the file is as long as its header says
  const NiftiHeader nifti = read_nifti_header(path);
  ControlPoints points{nifti.sform_code > 0 ? nifti.sform : nifti.qform, {}};
  const glm::i64vec3 size = points.grid.size;
  require(size.x >= 4 && size.y >= 4 && size.z >= 4,
          "a grid of " + to_string(size) + " control points, " + file + "; expected at least 4 on every axis");
  require(nifti.vox_offset == kFirstByte, "a control point grid with header extensions (vox_offset " +
                                              std::to_string(nifti.vox_offset) + "), " + file +
                                              "; make a displacement field of it with reg_transform -disp");
  points.displacement = {size, read_double_vectors(*image)};
  const AffineMap rest = point_from_index(points.grid);
  for (std::size_t v = 0; v < points.displacement.control.size(); ++v) {
    glm::dvec3& d = points.displacement.control[v];
    const auto n = static_cast<std::int64_t>(v);
    const glm::i64vec3 at(n % size.x, n / size.x % size.y, n / (size.x * size.y));
    require(glm::length(d) < 1e9, [&] {  // false for NaN
      return "control point (" + std::to_string(at.x) + ", " + std::to_string(at.y) + ", " + std::to_string(at.z) +
             ") is not finite, or beyond 1e9 mm, " + file + "; every one needs a position";
    });
    d = kLpsFromRas * d - rest(glm::dvec3(at));
  }
  return points;
}

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return image_format(path) == ImageFormat::nifti;
}

bool holds_transform(const std::filesystem::path& path) {
  try {
    return is_file(path) && is_niftyreg_spline(read_nifti_header(path));
  } catch (const InputError&) {
    return false;  // refused with a reason when it is read as a volume or a field
  }
}

TransformFile read(const FieldSource& source, const std::stop_token&) {
  const auto points = std::make_shared<const ControlPoints>(read_control_points(source.path));
  const AffineMap index = index_from_point(points->grid);
  TransformFile result;
  result.tool = "NiftyReg";
  result.classes = {"cubic B-spline of " + to_string(points->grid.size) + " control points"};
  result.parameters = 3 * points->displacement.control.size();
  result.direction = Direction::pull;
  result.beyond = "where its outermost control points go on";
  result.outside = std::make_shared<std::atomic<std::uint64_t>>(0);
  result.displacement = [points, index, outside = result.outside](const glm::dvec3& point) {
    const glm::dvec3 at = index(point), last(points->grid.size - std::int64_t{2});
    if (glm::clamp(at, glm::dvec3(1 - kRounding), last + kRounding) != at)
      outside->fetch_add(1, std::memory_order_relaxed);
    return points->displacement.at(at);
  };
  return result;
}

}  // namespace

const TransformFormat kTransformFormat_niftyreg = {recognizes, holds_transform, nullptr, read, nullptr};

bool is_niftyreg_spline(const NiftiHeader& header) {
  return header.intent_name == "NREG_TRANS" && header.intent_p.x == 2;
}

}  // namespace tetwarp
