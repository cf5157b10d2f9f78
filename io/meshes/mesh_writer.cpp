// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/mesh_writer.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "deform/errors.h"
#include "io/meshes/mesh_lattice.h"

namespace tetwarp {

namespace {

constexpr std::uint8_t kVtkTetra = 10;

/// A file that is written; a failure is thrown with the system's reason.
class MeshFileStream {
 public:
  explicit MeshFileStream(const std::filesystem::path& path) : path_(path), out_(path, std::ios::binary) { check(); }

  void text(const std::string& text) {
    out_.write(text.data(), static_cast<std::streamsize>(text.size()));
    check();
  }
  /// Writes numbers. @param swap  whether to reverse the bytes of each: VTK's legacy files are big endian
  template <class T>
  void numbers(const std::vector<T>& values, bool swap) {
    constexpr std::size_t kAtOnce = 1 << 16;
    std::vector<char> bytes;
    for (std::size_t begin = 0; begin < values.size(); begin += kAtOnce) {
      const std::size_t count = std::min(kAtOnce, values.size() - begin);
      bytes.resize(count * sizeof(T));
      std::memcpy(bytes.data(), values.data() + begin, bytes.size());
      for (std::size_t n = 0; swap && n < bytes.size(); n += sizeof(T))
        std::reverse(bytes.data() + n, bytes.data() + n + sizeof(T));
      out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      check();
    }
  }
  void close() {
    out_.close();
    check();
  }

 private:
  void check() {
    if (!out_) throw Error("cannot write " + path_.string() + ": " + std::strerror(errno));
  }

  std::filesystem::path path_;
  std::ofstream out_;
};

std::vector<double> flat(const std::vector<glm::dvec3>& points) {
  std::vector<double> values;
  for (const glm::dvec3& p : points) values.insert(values.end(), {p.x, p.y, p.z});
  return values;
}

std::vector<float> flat(const std::vector<glm::vec3>& vectors) {
  std::vector<float> values;
  for (const glm::vec3& v : vectors) values.insert(values.end(), {v.x, v.y, v.z});
  return values;
}

std::vector<std::int32_t> lattice_vertices(const TetrahedralMesh& mesh) {
  return {mesh.lattice_vertex.begin(), mesh.lattice_vertex.end()};
}

void write_legacy(MeshFileStream& out, const TetrahedralMesh& mesh, const Geometry& lattice) {
  constexpr bool kSwap = std::endian::native == std::endian::little;
  const std::size_t points = mesh.rest.size(), cells = mesh.tetrahedra.size();
  out.text("# vtk DataFile Version 3.0\nTetwarp forward field; SPACE=LPS\nBINARY\nDATASET UNSTRUCTURED_GRID\n");
  const bool of_lattice = !mesh.lattice_vertex.empty();
  if (of_lattice) {
    const std::vector<double> numbers = mesh_lattice_numbers(lattice);
    out.text(std::string("FIELD FieldData 1\n") + kMeshLatticeArray + " 1 " + std::to_string(numbers.size()) +
             " double\n");
    out.numbers(numbers, kSwap);
    out.text("\n");
  }
  out.text("POINTS " + std::to_string(points) + " double\n");
  out.numbers(flat(mesh.rest), kSwap);
  out.text("\nCELLS " + std::to_string(cells) + " " + std::to_string(5 * cells) + "\n");
  std::vector<std::int32_t> corners;
  for (const glm::u32vec4& t : mesh.tetrahedra) {
    corners.push_back(4);
    for (int n = 0; n < 4; ++n) corners.push_back(static_cast<std::int32_t>(t[n]));
  }
  out.numbers(corners, kSwap);
  out.text("\nCELL_TYPES " + std::to_string(cells) + "\n");
  out.numbers(std::vector<std::int32_t>(cells, kVtkTetra), kSwap);
  out.text("\nPOINT_DATA " + std::to_string(points) + "\nVECTORS displacement float\n");
  out.numbers(flat(mesh.displacement), kSwap);
  out.text("\n");
  if (!of_lattice) return;
  out.text(std::string("SCALARS ") + kMeshLatticeVertexArray + " int 1\nLOOKUP_TABLE default\n");
  out.numbers(lattice_vertices(mesh), kSwap);
  out.text("\n");
}

/// The values that follow the XML: one array after the other, each preceded by its length in bytes.
class Appended {
 public:
  explicit Appended(MeshFileStream& out) : out_(out) {}

  template <class T>
  std::string array(const char* type, const char* name, int components, std::size_t values,
                    const std::string& further = "") {
    const std::string text = std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
                             "\" NumberOfComponents=\"" + std::to_string(components) + "\"" + further +
                             " format=\"appended\" offset=\"" + std::to_string(offset_) + "\"/>";
    offset_ += sizeof(std::uint64_t) + values * sizeof(T);
    return text;
  }
  template <class T>
  void data(const std::vector<T>& values) {
    out_.numbers(std::vector<std::uint64_t>{values.size() * sizeof(T)}, false);
    out_.numbers(values, false);
  }

 private:
  MeshFileStream& out_;
  std::size_t offset_ = 0;
};

void write_xml(MeshFileStream& out, const TetrahedralMesh& mesh, const Geometry& lattice) {
  const std::size_t points = mesh.rest.size(), cells = mesh.tetrahedra.size();
  Appended appended(out);
  const std::string displacement = appended.array<float>("Float32", "displacement", 3, 3 * points);
  const std::string rest = appended.array<double>("Float64", "Points", 3, 3 * points);
  const std::string corners = appended.array<std::int64_t>("Int64", "connectivity", 1, 4 * cells);
  const std::string ends = appended.array<std::int64_t>("Int64", "offsets", 1, cells);
  const std::string types = appended.array<std::uint8_t>("UInt8", "types", 1, cells);
  const bool of_lattice = !mesh.lattice_vertex.empty();
  std::string whole, numbers_of_points;
  if (of_lattice) {
    whole = "<FieldData>" +
            appended.array<double>("Float64", kMeshLatticeArray, 1, kMeshLatticeNumbers,
                                   " NumberOfTuples=\"" + std::to_string(kMeshLatticeNumbers) + "\"") +
            "</FieldData>\n";
    numbers_of_points = "\n" + appended.array<std::int32_t>("Int32", kMeshLatticeVertexArray, 1, points);
  }
  const char* order = std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";
  out.text(std::string("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"") +
           order + "\" header_type=\"UInt64\">\n<UnstructuredGrid>\n" + whole + "<Piece NumberOfPoints=\"" +
           std::to_string(points) + "\" NumberOfCells=\"" + std::to_string(cells) +
           "\">\n<PointData Vectors=\"displacement\">" + displacement + numbers_of_points + "</PointData>\n<Points>" +
           rest + "</Points>\n<Cells>" + corners + "\n" + ends + "\n" + types +
           "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
  appended.data(flat(mesh.displacement));
  appended.data(flat(mesh.rest));
  std::vector<std::int64_t> numbers;
  for (const glm::u32vec4& t : mesh.tetrahedra) numbers.insert(numbers.end(), {t.x, t.y, t.z, t.w});
  appended.data(numbers);
  numbers.clear();
  for (std::size_t n = 1; n <= cells; ++n) numbers.push_back(static_cast<std::int64_t>(4 * n));
  appended.data(numbers);
  appended.data(std::vector<std::uint8_t>(cells, kVtkTetra));
  if (of_lattice) {
    appended.data(mesh_lattice_numbers(lattice));
    appended.data(lattice_vertices(mesh));
  }
  out.text("\n</AppendedData>\n</VTKFile>\n");
}

}  // namespace

bool has_mesh_suffix(const std::filesystem::path& path) {
  return path.extension() == ".vtu" || path.extension() == ".vtk";
}

void write_mesh_file(const std::filesystem::path& path, const TetrahedralMesh& mesh, const Geometry& lattice) {
  require(has_mesh_suffix(path), "a mesh is written as .vtu or .vtk, not as " + path.string());
  require(mesh.rest.size() == mesh.displacement.size() && mesh.rest.size() < INT32_MAX,
          "a mesh of " + std::to_string(mesh.rest.size()) + " vertices and " +
              std::to_string(mesh.displacement.size()) + " displacements cannot be written");
  require(mesh.lattice_vertex.empty() ||
              (mesh.lattice_vertex.size() == mesh.rest.size() && voxel_count(lattice) < INT32_MAX),
          "the lattice of a mesh, of " + to_string(lattice.size) + " vertices, cannot be written");
  for (const glm::u32vec4& t : mesh.tetrahedra) {
    if (std::max(std::max(t.x, t.y), std::max(t.z, t.w)) >= mesh.rest.size())
      throw InputError("a tetrahedron of a mesh has a vertex beyond its " + std::to_string(mesh.rest.size()));
  }
  MeshFileStream out(path);
  if (path.extension() == ".vtk") {
    write_legacy(out, mesh, lattice);
  } else {
    write_xml(out, mesh, lattice);
  }
  out.close();
}

}  // namespace tetwarp
