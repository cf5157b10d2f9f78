// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_vtk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "deform/errors.h"
#include "io/meshes/vector_options.h"
#include "io/meshes/vtk_file.h"

namespace tetwarp {
namespace {

// How far a point may lie from its place in the lattice, as part of the smallest step.
constexpr double kOffLattice = 1e-3;
constexpr double kRightAngle = 1e-4;  // the largest cosine of the angle between two axes

void check_options(const FieldSource& source) {
  for (const auto& [key, value] : source.options) {
    const std::string what = key + "=" + value + ", " + source.path.string();
    require(key == "displacement" || key == "frame" || key == "units",
            "the option \"" + key + "\", " + source.path.string() + "; expected displacement, frame or units");
    require(key != "frame" || value == "lps" || value == "ras", what + "; expected lps or ras");
    require(key != "units" || value == "mm" || value == "m", what + "; expected mm or m");
  }
}

/// Chooses the vectors that are the displacement. @throws InputError that lists the vectors of the file
VtkArray displacement_of(const VtkFile& file, const FieldSource& source) {
  std::vector<VtkArray> vectors;
  std::set<std::string> names;
  std::string listed;
  for (const VtkArray& array : file.point_data) {
    if (array.components != 3) continue;
    vectors.push_back(array);
    names.insert(array.name);
    listed += (listed.empty() ? "\"" : ", \"") + array.name + "\"";
  }
  require(!vectors.empty(), "no vectors at the points, " + file.name +
                                "; expected point data with three components that says how far each point moves");
  const std::string give = "; it has " + listed + ": give " + file.name + ":displacement=NAME";
  if (source.options.contains("displacement")) {
    const std::string name = source.option("displacement");
    require(names.contains(name), "no vectors \"" + name + "\" at the points, " + file.name + "; it has " + listed);
    names = {name};
  } else if (vectors.size() > 1) {
    names = usual_displacements(names);
  }
  std::vector<VtkArray> chosen;
  std::copy_if(vectors.begin(), vectors.end(), std::back_inserter(chosen),
               [&names](const VtkArray& array) { return names.contains(array.name); });
  require(chosen.size() == 1,
          std::to_string(vectors.size()) + " arrays of vectors, which is the displacement? " + file.name + give);
  return chosen[0];
}

/// A lattice in the file's frame and units: at index i the point is corner + steps * i.
struct Lattice {
  glm::dvec3 corner{0};
  glm::dmat3 steps{1};
};

std::string vertex_name(std::uint64_t number, const glm::i64vec3& size) {
  const auto n = static_cast<std::int64_t>(number);
  return "vertex (" + std::to_string(n % size.x) + ", " + std::to_string(n / size.x % size.y) + ", " +
         std::to_string(n / (size.x * size.y)) + ")";
}

/// Refuses a grid with one point on an axis, which has no step there.
void require_two_an_axis(const VtkFile& file) {
  require(std::min({file.size.x, file.size.y, file.size.z}) > 1,
          "a grid of " + to_string(file.size) + " points, " + file.name + "; expected at least 2 on every axis");
}

void require_right_angles(const Lattice& lattice, const VtkFile& file) {
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 a = lattice.steps[axis], b = lattice.steps[(axis + 1) % 3];
    const double both = glm::length(a) * glm::length(b);
    require(both > 0 && std::isfinite(both),
            "points that do not form a lattice, " + file.name + ": its corners are not four points apart");
    require(
        std::abs(glm::dot(a, b)) <= kRightAngle * both,
        "axes that are not at right angles, " + file.name + "; a field needs a regular lattice, others go as a mesh");
  }
}

double shortest_step(const Lattice& lattice) {
  return std::min({glm::length(lattice.steps[0]), glm::length(lattice.steps[1]), glm::length(lattice.steps[2])});
}

void require_on_lattice(const glm::dvec3& point, const glm::dvec3& place, double tolerance, std::uint64_t vertex,
                        const VtkFile& file) {
  const double off = glm::length(point - place);
  if (off <= tolerance) return;  // not so for NaN
  throw InputError("points that do not form a regular lattice, " + file.name + ": " + vertex_name(vertex, file.size) +
                   " lies " + std::to_string(off) + " off its place, " + std::to_string(tolerance) +
                   " are allowed; an irregular grid goes as a mesh (.vtu)");
}

/// The lattice of a structured grid, by its corners. @throws InputError where a point is not in its place
Lattice lattice_of_points(const VtkFile& file) {
  require_two_an_axis(file);
  const glm::i64vec3 size = file.size;
  const auto point = [&file](std::int64_t vertex) {
    glm::dvec3 result;
    file.read(file.points, static_cast<std::uint64_t>(3 * vertex), std::span(&result[0], 3));
    return result;
  };
  Lattice lattice{point(0), {}};
  std::int64_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t steps = size[axis] - 1;
    lattice.steps[axis] = (point(steps * stride) - lattice.corner) / static_cast<double>(steps);
    stride *= size[axis];
  }
  require_right_angles(lattice, file);
  const double tolerance = kOffLattice * shortest_step(lattice);
  file.read_all(file.points, [&](std::uint64_t first, std::span<const double> values) {
    for (std::uint64_t n = 0; n < values.size() / 3; ++n) {
      const auto vertex = static_cast<std::int64_t>(first + n);
      const glm::dvec3 index(vertex % size.x, vertex / size.x % size.y, vertex / (size.x * size.y));
      require_on_lattice({values[3 * n], values[3 * n + 1], values[3 * n + 2]}, lattice.corner + lattice.steps * index,
                         tolerance, first + n, file);
    }
  });
  return lattice;
}

Lattice lattice_of_coordinates(const VtkFile& file) {
  require_two_an_axis(file);
  Lattice lattice{glm::dvec3(0), glm::dmat3(0)};
  std::array<std::vector<double>, 3> all;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& along = all[static_cast<std::size_t>(axis)];
    file.read_all(file.coordinates[static_cast<std::size_t>(axis)], [&](std::uint64_t, std::span<const double> part) {
      along.insert(along.end(), part.begin(), part.end());
    });
    lattice.corner[axis] = along.front();
    lattice.steps[axis][axis] = (along.back() - along.front()) / static_cast<double>(along.size() - 1);
  }
  require_right_angles(lattice, file);
  const double tolerance = kOffLattice * shortest_step(lattice);
  std::uint64_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double>& along = all[static_cast<std::size_t>(axis)];
    for (std::size_t n = 0; n < along.size(); ++n) {
      glm::dvec3 point = lattice.corner, place = lattice.corner;
      point[axis] = along[n];
      place[axis] += lattice.steps[axis][axis] * static_cast<double>(n);
      require_on_lattice(point, place, tolerance, n * stride, file);
    }
    stride *= along.size();
  }
  return lattice;
}

Lattice lattice_of_image(const VtkFile& file) {
  Lattice lattice{file.origin, file.direction};
  for (int axis = 0; axis < 3; ++axis) lattice.steps[axis] *= file.spacing[axis];
  lattice.corner += lattice.steps * glm::dvec3(file.begin);
  require_right_angles(lattice, file);
  return lattice;
}

Lattice lattice_of(const VtkFile& file) {
  switch (file.dataset) {
    case VtkDataset::structured_grid: return lattice_of_points(file);
    case VtkDataset::rectilinear_grid: return lattice_of_coordinates(file);
    case VtkDataset::image: return lattice_of_image(file);
    case VtkDataset::unstructured_grid:
    case VtkDataset::other: break;
  }
  throw InputError("no grid, " + file.name + "; expected a StructuredGrid, ImageData or a RectilinearGrid");
}

/// The geometry of the grid in LPS mm. @param to_lps_mm  factors that turn the file's frame and units into LPS mm
Geometry grid_of(const VtkFile& file, const glm::dvec3& to_lps_mm) {
  const Lattice lattice = lattice_of(file);
  Geometry grid;
  grid.size = file.size;
  grid.origin = to_lps_mm * lattice.corner;
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 step = to_lps_mm * lattice.steps[axis];
    grid.spacing[axis] = glm::length(step);
    grid.direction[axis] = step / grid.spacing[axis] + 0.0;  // + 0.0 makes 0 of -0
  }
  require_valid(grid, file.name);
  return grid;
}

void take_frame_and_units(const VtkFile& file, const FieldSource& source, FieldFileHeader& header) {
  header.frame_basis = take_stated(file.frame, frame_option(source), file.name, header.frame);
  header.units_basis = take_stated({}, source.option("units"), file.name, header.units);
}

class VtkFieldReader final : public FieldReader {
 public:
  VtkFieldReader(FieldFileHeader header, std::unique_ptr<VtkFile> file, VtkArray vectors, const glm::dvec3& to_lps_mm)
      : FieldReader(std::move(header)), file_(std::move(file)), vectors_(std::move(vectors)), to_lps_mm_(to_lps_mm) {}

  void read(std::span<glm::vec3> displacement) const override {
    file_->read_all(vectors_, [&](std::uint64_t first, std::span<const double> values) {
      for (std::uint64_t n = 0; n < values.size() / 3; ++n) {
        const glm::dvec3 vector(values[3 * n], values[3 * n + 1], values[3 * n + 2]);
        displacement[first + n] = glm::vec3(to_lps_mm_ * vector + 0.0);  // + 0.0 makes 0 of -0
      }
    });
  }

 private:
  std::unique_ptr<VtkFile> file_;
  VtkArray vectors_;
  glm::dvec3 to_lps_mm_;
};

bool recognizes(const std::filesystem::path& path, std::string_view first_bytes) {
  return (has_vtk_suffix(path) || first_bytes.starts_with("# vtk DataFile")) &&
         vtk_dataset(path) != VtkDataset::unstructured_grid;
}

bool holds_field(const FieldSource& source) { return vtk_dataset(source.path) != VtkDataset::other; }

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  check_options(source);
  auto file = open_vtk_file(source.path);
  FieldFileHeader header;
  take_frame_and_units(*file, source, header);
  const glm::dvec3 to_mm = to_lps_mm(header.frame, header.units);
  VtkArray vectors = displacement_of(*file, source);
  header.format = file->format + ", vectors \"" + vectors.name + "\"";
  header.grid = grid_of(*file, to_mm);
  return std::make_unique<VtkFieldReader>(std::move(header), std::move(file), std::move(vectors), to_mm);
}

}  // namespace

const FieldFormat kFieldFormat_vtk = {recognizes, holds_field, check_options, open};

}  // namespace tetwarp
