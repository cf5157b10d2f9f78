// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "deform/errors.h"
#include "io/images/nifti_file.h"

namespace tetwarp {
namespace {

using HeaderBytes = std::array<unsigned char, 348>;

/// The number at `offset` (nifti1.h), in native byte order.
template <class T>
T number(const HeaderBytes& bytes, std::size_t offset, bool swapped) {
  std::array<unsigned char, sizeof(T)> raw;
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), raw.begin());
  if (swapped) std::reverse(raw.begin(), raw.end());
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  return value;
}

HeaderBytes read_bytes(const std::filesystem::path& path) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), gzclose);
  require(file != nullptr, "cannot open, " + path.string());
  HeaderBytes bytes{};
  const int read = gzread(file.get(), bytes.data(), bytes.size());
  require(read >= 0, "damaged gzip data, " + path.string() + "; copy the file again");
  require(read != 0, "an empty file, " + path.string());
  require(read == static_cast<int>(bytes.size()),
          "a header of " + std::to_string(read) + " bytes, " + path.string() + "; a NIfTI-1 header has 348");
  return bytes;
}

/// Columns in RAS mm to an LPS geometry.
Geometry from_ras(const std::array<glm::dvec3, 4>& columns, const glm::i64vec3& size) {
  constexpr glm::dvec3 kLps(-1, -1, 1);
  Geometry grid;
  grid.size = size;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 step = kLps * columns[static_cast<std::size_t>(axis)] + 0.0;  // no -0
    grid.spacing[axis] = glm::length(step);
    grid.direction[axis] = step / grid.spacing[axis];
  }
  grid.origin = kLps * columns[3] + 0.0;
  return grid;
}

/// Unit quaternion (a, b, c, d) of nifti1.h, of which a file has b, c, d.
struct Quaternion {
  double a = 0, b = 0, c = 0, d = 0;
  double rounding = 0;  ///< radians by which the float32 of b, c and d may turn it: most where a is near 0
};

Quaternion quaternion(const HeaderBytes& bytes, bool swapped) {
  const auto f = [&](std::size_t offset) { return static_cast<double>(number<float>(bytes, offset, swapped)); };
  constexpr double kRounding = 4.0 / (1 << 24);  // of b^2 + c^2 + d^2
  Quaternion q{0, f(256), f(260), f(264), 0};
  const double squares = q.b * q.b + q.c * q.c + q.d * q.d;
  if (squares > 1 - 1e-7) {                                           // a half turn: as niftilib and nibabel have it
    const double length = squares < 1.01 ? std::sqrt(squares) : NAN;  // what is longer by more than rounding is damage
    q = {0, q.b / length, q.c / length, q.d / length, 2 * std::sqrt(kRounding + 1e-7)};
  } else {
    q.a = std::sqrt(1 - squares);
    q.rounding = 2 * std::min(std::sqrt(kRounding), kRounding / (2 * q.a)) + kRounding;
  }
  return q;
}

/// Method 2 of nifti1.h: quaternion, pixdim, qfac = pixdim[0].
Geometry qform(const HeaderBytes& bytes, bool swapped, const Quaternion& q, const glm::i64vec3& size) {
  const auto f = [&](std::size_t offset) { return static_cast<double>(number<float>(bytes, offset, swapped)); };
  const auto [a, b, c, d, rounding] = q;
  const double flip = f(76) < 0 ? -1 : 1;
  return from_ras({glm::dvec3(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)) * f(80),
                   glm::dvec3(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)) * f(84),
                   glm::dvec3(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c) * (f(88) * flip),
                   glm::dvec3(f(268), f(272), f(276))},
                  size);
}

/// Method 3 of nifti1.h: srow_x, srow_y, srow_z.
Geometry sform(const HeaderBytes& bytes, bool swapped, const glm::i64vec3& size) {
  std::array<glm::dvec3, 4> columns;
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t row = 0; row < 3; ++row) {
      columns[column][static_cast<int>(row)] =
          static_cast<double>(number<float>(bytes, 280 + 16 * row + 4 * column, swapped));
    }
  }
  return from_ras(columns, size);
}

std::string text(const glm::dvec3& v) {
  return std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z);
}

/// @return the number of values a voxel
int require_one_volume(const NiftiHeader& header, NiftiVectors vectors, const std::string& file) {
  const auto& dim = header.dim;
  std::string dims;
  for (std::size_t i = 1; i < 8 && static_cast<std::int64_t>(i) <= dim[0]; ++i)
    dims += (i > 1 ? " x " : "") + std::to_string(dim[i]);
  require(dim[0] >= 3 && dim[0] <= 7, "an image of " + std::to_string(dim[0]) + " axes, " + file + "; expected 3");
  for (std::size_t i = 1; i < 8; ++i) {
    require(static_cast<std::int64_t>(i) > dim[0] || dim[i] >= 1,
            "a size of " + dims + ", " + file + "; expected at least 1 on every axis");
  }
  const auto beyond = [&](std::size_t i) { return static_cast<std::int64_t>(i) <= dim[0] ? dim[i] : 1; };
  const bool on_fourth = vectors == NiftiVectors::declared && beyond(4) == 3 && beyond(5) == 1;
  require(on_fourth || !(is_fsl_field(header.intent_code) || is_fsl_coefficients(header.intent_code)),
          "a field or coefficients of FSL (intent code " + std::to_string(header.intent_code) + "), " + file +
              ", is no volume of one value a voxel");
  const std::string say = ", or say that they are vectors: " + file + ":values=displacements|positions,frame=lps|ras";
  require(on_fourth || beyond(4) == 1, std::to_string(beyond(4)) + " time points (" + dims + "), " + file +
                                           "; split the file, one volume is expected" + (beyond(4) == 3 ? say : ""));
  const bool vector = beyond(5) > 1, may_be_vector = header.intent_code == 1006 || header.intent_code == 1007 ||
                                                     (vectors == NiftiVectors::declared && beyond(5) == 3);
  require(!vector || may_be_vector,
          std::to_string(beyond(5)) + " values a voxel with intent code " + std::to_string(header.intent_code) + ", " +
              file + "; expected 1 value, or vectors with intent code 1006 or 1007" + (beyond(5) == 3 ? say : ""));
  require(header.intent_code != 1006 || beyond(5) == 3 || on_fourth,
          "displacement vectors (intent code 1006, DISPVECT) of " + std::to_string(beyond(5)) + " values, " + file +
              "; expected 3");
  require(beyond(6) == 1 && beyond(7) == 1, "a size of " + dims + ", " + file + "; expected 3 axes and no more");
  return static_cast<int>(on_fourth ? beyond(4) : beyond(5));
}

/// What both forms need. Numbers that are huge, or none, are damage: no scanner is a thousand kilometres long.
void require_known_place(const NiftiHeader& header, const std::string& file) {
  constexpr int kMillimetres = 2;
  require(header.units == 0 || header.units == kMillimetres, "lengths in " +
                                                                 std::string(header.units == 1   ? "metres"
                                                                             : header.units == 3 ? "micrometres"
                                                                                                 : "unknown units") +
                                                                 " (xyzt_units), " + file + "; expected mm");
  require(header.qform_code > 0 || header.sform_code > 0,
          "no orientation (qform_code 0 and sform_code 0), " + file + "; set the qform or the sform");
  for (const auto& [code, grid] : {std::pair(header.qform_code, &header.qform), {header.sform_code, &header.sform}}) {
    const bool near = glm::length(grid->origin) + glm::length(grid->spacing) < 1e9;  // false for NaN
    require(code <= 0 || near,
            "a qform or sform that is not finite, no rotation, or beyond 1e9 mm, " + file + "; correct the header");
  }
}

/// How far a voxel's places by the two forms lie apart at most, where rounding does not explain it: of float32 in
/// either, and of writers that computed one form from the other in float32.
std::optional<double> apart_mm(const NiftiHeader& header) {
  if (header.qform_code <= 0 || header.sform_code <= 0) return {};
  const AffineMap by_sform = point_from_index(header.sform), by_qform = point_from_index(header.qform);
  double apart = 0, reach = 0, size = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index =
        glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(header.qform.size - std::int64_t{1});
    apart = std::max(apart, glm::distance(by_sform(index), by_qform(index)));
    reach = std::max(reach, glm::length(by_sform(index)));
    size = std::max(size, glm::distance(by_sform(index), by_sform(glm::dvec3(0))));
  }
  const double rounding = 1e-3 + 1e-5 * (reach + size) + header.qform_rounding * size;
  if (apart <= rounding) return {};
  return apart;
}

std::string other_way(const NiftiHeader& header) {
  return header.qform_code > 0 ? ", or give --nifti-frame qform" : "";
}

}  // namespace

const Geometry& place_of(const NiftiHeader& header, NiftiFrame frame, const std::filesystem::path& path) {
  const std::string file = path.string();
  const bool by_sform = frame == NiftiFrame::sform ? header.sform_code > 0 : header.qform_code <= 0;
  const glm::dvec3& pixdim = header.pixdim;
  if (!by_sform) {
    require(pixdim.x > 0 && pixdim.y > 0 && pixdim.z > 0,
            "a voxel size of " + text(pixdim) + " mm by pixdim, " + file + "; expected more than 0");
    return header.qform;
  }
  const glm::dmat3& d = header.sform.direction;
  const glm::dvec3 cosines(glm::dot(d[0], d[1]), glm::dot(d[0], d[2]), glm::dot(d[1], d[2]));
  const bool orthogonal = std::abs(cosines.x) <= 1e-4 && std::abs(cosines.y) <= 1e-4 && std::abs(cosines.z) <= 1e-4;
  require(orthogonal, "a sheared or singular sform (cosines between its axes " + text(cosines) + ", expected 0), " +
                          file + "; resample it onto an orthogonal grid" + other_way(header));
  const glm::dvec3 difference = glm::abs(header.sform.spacing - pixdim);
  require(difference.x <= 1e-3 && difference.y <= 1e-3 && difference.z <= 1e-3,
          "a voxel size of " + text(header.sform.spacing) + " mm by the sform and " + text(pixdim) + " mm by pixdim, " +
              file + "; correct the header" + other_way(header));
  return header.sform;
}

NiftiHeader read_nifti_header(const std::filesystem::path& path, NiftiVectors vectors) {
  const std::string file = path.string();
  const HeaderBytes bytes = read_bytes(path);
  NiftiHeader header;
  const auto size = number<std::int32_t>(bytes, 0, false);
  require(size != 540 && size != 0x1c020000, "a NIfTI-2 file, " + file + "; expected NIfTI-1: convert it");
  header.swapped = size != 348 && number<std::int32_t>(bytes, 0, true) == 348;
  require(size == 348 || header.swapped,
          "not a NIfTI file (header size " + std::to_string(size) + ", expected 348), " + file);
  const std::string magic(bytes.begin() + 344, bytes.begin() + 347);
  require(magic == "n+1",
          "not NIfTI-1 in one file (magic \"" + (magic == "ni1" ? magic : "?") + "\", expected \"n+1\"), " + file);
  const auto i16 = [&](std::size_t offset) { return number<std::int16_t>(bytes, offset, header.swapped); };
  const auto f32 = [&](std::size_t offset) {
    return static_cast<double>(number<float>(bytes, offset, header.swapped));
  };
  for (std::size_t i = 0; i < 8; ++i) header.dim[i] = i16(40 + 2 * i);
  header.intent_code = i16(68);
  header.datatype = i16(70);
  header.vox_offset = f32(108);
  header.scl_slope = f32(112);
  header.scl_inter = f32(116);
  header.intent_p = {f32(56), f32(60), f32(64)};
  header.units = bytes[123] & 7;
  header.descrip.assign(bytes.begin() + 148, std::find(bytes.begin() + 148, bytes.begin() + 228, 0));
  header.intent_name.assign(bytes.begin() + 328, std::find(bytes.begin() + 328, bytes.begin() + 344, 0));
  header.qform_code = i16(252);
  header.sform_code = i16(254);
  header.components = require_one_volume(header, vectors, file);
  const glm::i64vec3 voxels(header.dim[1], header.dim[2], header.dim[3]);
  const Quaternion turn = quaternion(bytes, header.swapped);
  header.qform_rounding = turn.rounding;
  header.qform = qform(bytes, header.swapped, turn, voxels);
  header.sform = sform(bytes, header.swapped, voxels);
  header.pixdim = {f32(80), f32(84), f32(88)};
  require_known_place(header, file);
  header.apart_mm = apart_mm(header);
  return header;
}

}  // namespace tetwarp
