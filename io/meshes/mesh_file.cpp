// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/mesh_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/images/image_reader.h"
#include "io/meshes/mesh_format.h"
#include "io/meshes/model_builder.h"
#include "io/meshes/vector_options.h"
#include "io/opened_file.h"

namespace tetwarp {
namespace {

const MeshFormat* format_of(const std::filesystem::path& path) {
  if (!is_file(path)) return find_mesh_format(path, "");
  std::string first(64, '\0');
  std::ifstream stream = opened(path);
  stream.read(first.data(), static_cast<std::streamsize>(first.size()));
  first.resize(static_cast<std::size_t>(stream.gcount()));
  return find_mesh_format(path, first);
}

std::unique_ptr<MeshReader> open_mesh(const std::filesystem::path& path) {
  const std::string file = path.string();
  require_readable_file(path);
  const MeshFormat* format = format_of(path);
  require(format != nullptr, "not a mesh file, " + file + "; expected " + mesh_suffixes());
  auto reader = format->open(path);
  if (reader->cells.tetrahedra().empty()) {
    std::string notes;
    for (const std::string& note : reader->notes) notes += " (" + note + ")";
    throw InputError("no cells with a volume, " + file + notes +
                     "; expected tetrahedra, hexahedra, wedges or pyramids");
  }
  return reader;
}

std::int64_t step_of(const FieldSource& source) {
  const std::string text = source.option("step");
  const auto step = number_from<std::int64_t>(text);
  require(step.has_value(), "step=" + text + " for " + source.path.string() + "; expected a whole number");
  return *step;
}

/// The name of an array for messages: "U", or "U, step 3" where there are several steps, or they are `wanted`.
std::string name_of(const MeshReader& reader, const MeshVectors& array, bool wanted = false) {
  const auto steps = std::count_if(reader.arrays.begin(), reader.arrays.end(),
                                   [&](const MeshVectors& other) { return other.name == array.name; });
  return array.name + (array.step && (wanted || steps > 1) ? ", step " + std::to_string(*array.step) : "");
}

/// The names of all arrays, for the end of a message: `; it has "A", "B"`. @param steps  whether with their steps
std::string listed(const MeshReader& reader, bool steps = false) {
  std::string text;
  for (const MeshVectors& array : reader.arrays)
    text += (text.empty() ? "; it has \"" : ", \"") + name_of(reader, array, steps) + "\"";
  return text.empty() ? "; it has no vectors at its vertices" : text;
}

/// The names of the vectors that are called by one of some words; where none is, those whose short name is one.
std::set<std::string> names_called(const MeshReader& reader, const std::set<std::string>& words) {
  std::set<std::string> names, by_short_name;
  for (const MeshVectors& array : reader.arrays) {
    if (words.contains(array.name)) names.insert(array.name);
    if (!array.short_name.empty() && words.contains(array.short_name)) by_short_name.insert(array.name);
  }
  return names.empty() ? by_short_name : names;
}

/// Chooses the vectors of the file that are the displacement; empty: that cannot be decided. @throws InputError for an
/// option that fits no vectors
std::optional<std::size_t> chosen_vectors(const MeshReader& reader, const FieldSource& source) {
  std::set<std::string> names, words;
  for (const MeshVectors& array : reader.arrays) {
    names.insert(array.name);
    words.insert({array.name, array.short_name});
  }
  if (source.options.contains("displacement")) {
    const std::string asked = source.option("displacement");
    names = names_called(reader, {asked});
    require(asked.empty() || names.size() == 1, (names.empty() ? "no vectors" : "several vectors") +
                                                    (" called \"" + asked + "\" at the vertices of ") +
                                                    source.path.string() + listed(reader));
  } else if (names.size() > 1) {
    names = names_called(reader, usual_displacements(words));
  }
  if (names.size() != 1) return {};
  const std::string name = *names.begin();
  std::vector<std::size_t> found;
  for (std::size_t n = 0; n < reader.arrays.size(); ++n) {
    const MeshVectors& array = reader.arrays[n];
    if (array.name == name && (!source.options.contains("step") || array.step == step_of(source))) found.push_back(n);
  }
  require(!found.empty(),
          "no step " + source.option("step") + " of \"" + name + "\", " + source.path.string() + listed(reader, true));
  return found.size() == 1 ? std::optional(found[0]) : std::nullopt;
}

void take_frame_and_units(const MeshReader& reader, const FieldSource& source, MeshFileHeader& header) {
  const std::string file = source.path.string();
  header.frame_basis = take_stated(reader.frame, frame_option(source), file, header.frame);
  header.units_basis = take_stated(reader.units, source.option("units"), file, header.units);
}

std::uint64_t tag_of(const MeshReader& reader, std::size_t vertex) {
  return reader.tags.empty() ? vertex : reader.tags[vertex];
}

/// The displacement from rest to the positions of a second file. @throws InputError unless both files have the same
/// vertices and cells
std::vector<glm::dvec3> from_deformed(const MeshReader& rest, const FieldSource& source, const MeshFileHeader& header) {
  const std::string path = source.option("deformed"), both = path + " and " + source.path.string();
  const auto deformed = open_mesh(path);
  const std::string what = "; the deformed mesh must have the vertices and cells of the mesh at rest";
  require(deformed->points.size() == rest.points.size(), std::to_string(deformed->points.size()) + " and " +
                                                             std::to_string(rest.points.size()) + " vertices, " + both +
                                                             what);
  for (std::size_t v = 0; v < rest.points.size(); ++v) {
    if (tag_of(rest, v) != tag_of(*deformed, v)) {
      throw InputError("the vertex " + std::to_string(tag_of(rest, v)) + " is in one file only, " + both + what);
    }
  }
  require(deformed->cells.counts() == rest.cells.counts() && deformed->cells.tetrahedra() == rest.cells.tetrahedra(),
          "other cells, " + both + what);
  require(
      deformed->frame.value_or(header.frame) == header.frame && deformed->units.value_or(header.units) == header.units,
      "another frame or other units, " + both);
  std::vector<glm::dvec3> displacement = std::move(deformed->points);
  for (std::size_t v = 0; v < displacement.size(); ++v) displacement[v] -= rest.points[v];
  const bool rests = std::ranges::all_of(displacement, [](const glm::dvec3& by) { return by == glm::dvec3(0); });
  require(!rests || deformed->arrays.empty(), "the vertices of " + path + " rest where those of " +
                                                  source.path.string() + " do" + listed(*deformed) +
                                                  ": give that file by itself");
  return displacement;
}

/// The displacements of a table: a line a vertex, with its number and three components; the first may be a heading.
/// @return NaN where the table has none
std::vector<glm::dvec3> from_table(const MeshReader& reader, const FieldSource& source) {
  const std::filesystem::path path = source.option("table");
  require_readable_file(path);
  std::ifstream stream(path, std::ios::binary);
  std::vector<glm::dvec3> displacement(reader.points.size(), glm::dvec3(NAN));
  std::vector<bool> seen(reader.points.size());
  std::int64_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    if (number == 0 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);  // a byte order mark of UTF-8
    ++number;
    std::ranges::replace_if(
        line, [](char c) { return c == ',' || c == ';' || c == '\t' || c == '\r'; }, ' ');
    std::istringstream words(line);
    std::array<std::string, 5> word;
    std::size_t count = 0;
    while (count < word.size() && words >> word[count]) ++count;
    const std::string where = " in line " + std::to_string(number) + " of " + path.string();
    // A heading names columns: none of its words is a number.
    const auto is_number = [](const std::string& text) { return number_from<double>(text).has_value(); };
    const bool heading = number == 1 && std::none_of(word.begin(), word.begin() + count, is_number);
    if (count == 0 || word[0].starts_with('#') || heading) continue;
    require(count == 4, "more or fewer than 4 values" + where + "; expected the number of a vertex and ux, uy, uz");
    const std::uint32_t vertex = vertex_numbered(reader, whole_in(word[0], where), where);
    require(!seen[vertex], "the vertex " + word[0] + " a second time" + where);
    seen[vertex] = true;
    for (int axis = 0; axis < 3; ++axis)
      displacement[vertex][axis] = real_in(word[static_cast<std::size_t>(axis) + 1], where);
  }
  return displacement;
}

/// One displacement a vertex in the file's frame and units; empty: it cannot be decided which of the vectors it is.
std::vector<glm::dvec3> displacement_of(const MeshReader& reader, const FieldSource& source, MeshFileHeader& header) {
  if (source.options.contains("deformed")) {
    header.displacement = "positions of " + source.option("deformed");
    return from_deformed(reader, source, header);
  }
  if (source.options.contains("table")) {
    header.displacement = "table " + source.option("table");
    return from_table(reader, source);
  }
  const auto chosen = chosen_vectors(reader, source);
  if (!chosen) return {};
  header.displacement = name_of(reader, reader.arrays[*chosen]);
  return reader.vectors(*chosen);
}

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void require_finite(const glm::dvec3& value, const char* what, std::uint64_t vertex, const FieldSource& source) {
  if (is_finite(value)) return;
  throw InputError(std::string(what) + " not finite (" + std::to_string(value.x) + ", " + std::to_string(value.y) +
                   ", " + std::to_string(value.z) + ") at vertex " + std::to_string(vertex) + ", " +
                   source.path.string() + "; every vertex of a cell needs a number");
}

constexpr std::uint32_t kUnused = UINT32_MAX;

/// New numbers of the vertices; a vertex of no tetrahedron has none.
std::vector<std::uint32_t> numbers_of_used(const MeshReader& reader) {
  std::vector<std::uint32_t> numbers(reader.points.size(), kUnused);
  for (const glm::u32vec4& tetrahedron : reader.cells.tetrahedra()) {
    for (int n = 0; n < 4; ++n) numbers[tetrahedron[n]] = 0;
  }
  std::uint32_t next = 0;
  for (std::uint32_t& number : numbers) {
    if (number != kUnused) number = next++;
  }
  return numbers;
}

/// Of tetrahedra that have the same vertices, keeps the first: MSH 2 lists an element of two physical groups twice.
/// @return how many were left out
std::size_t drop_repeated(std::vector<glm::u32vec4>& tetrahedra) {
  std::vector<std::pair<std::array<std::uint32_t, 4>, std::size_t>> sorted(tetrahedra.size());
  for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
    const glm::u32vec4& v = tetrahedra[t];
    sorted[t] = {{v[0], v[1], v[2], v[3]}, t};
    std::sort(sorted[t].first.begin(), sorted[t].first.end());
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<bool> repeated(tetrahedra.size());
  for (std::size_t n = 1; n < sorted.size(); ++n) {
    if (sorted[n].first == sorted[n - 1].first) repeated[sorted[n].second] = true;
  }
  std::size_t t = 0;
  return std::erase_if(tetrahedra, [&](const glm::u32vec4&) { return repeated[t++]; });
}

/// Takes from the file which vertex of the lattice each vertex of the mesh rests at, if the file says so and the places
/// agree. A file that another program moved or scaled is a mesh like any other.
/// @param numbers  what numbers_of_used returned
void take_lattice(const MeshReader& reader, const std::vector<std::uint32_t>& numbers, TetrahedralMesh& mesh,
                  MeshFileHeader& header) {
  if (!reader.lattice) return;
  const Geometry& lattice = reader.lattice->geometry;
  const AffineMap point = point_from_index(lattice);
  std::vector<std::int64_t> of_lattice;
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    if (numbers[v] == kUnused) continue;
    const std::int64_t vertex = reader.lattice->vertex[v];
    of_lattice.push_back(vertex);
    const glm::i64vec3& size = lattice.size;
    const glm::dvec3 index(vertex % size.x, vertex / size.x % size.y, vertex / (size.x * size.y));
    if (vertex < 0 || mesh.rest[numbers[v]] == point(index)) continue;
    header.notes.push_back("vertices are not where the lattice of the file has them, so it is taken as any mesh");
    return;
  }
  mesh.lattice_vertex = std::move(of_lattice);
  header.lattice = lattice;
}

/// Makes the mesh in LPS mm. @param displacement  what displacement_of returned
TetrahedralMesh mesh_of(MeshReader& reader, const std::vector<glm::dvec3>& displacement, const FieldSource& source,
                        MeshFileHeader& header) {
  const std::vector<std::uint32_t> numbers = numbers_of_used(reader);
  const glm::dvec3 to_mm = to_lps_mm(header.frame, header.units);
  TetrahedralMesh mesh;
  const auto used =
      static_cast<std::size_t>(std::count_if(numbers.begin(), numbers.end(), [](auto n) { return n != kUnused; }));
  mesh.rest.reserve(used);
  mesh.displacement.reserve(displacement.empty() ? 0 : used);
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    if (numbers[v] == kUnused) continue;
    mesh.rest.push_back(to_mm * reader.points[v]);
    require_finite(mesh.rest.back(), "a position that is", tag_of(reader, v), source);
    if (displacement.empty()) continue;
    const glm::dvec3 mm = to_mm * displacement[v];
    mesh.displacement.emplace_back(mm + 0.0);  // + 0.0 makes 0 of -0
    require_finite(glm::dvec3(mesh.displacement.back()), "a displacement that is missing or", tag_of(reader, v),
                   source);
    header.largest_mm = std::max(header.largest_mm.value_or(0), glm::length(mm));
  }
  take_lattice(reader, numbers, mesh, header);
  mesh.tetrahedra = reader.cells.take();
  for (glm::u32vec4& tetrahedron : mesh.tetrahedra) {
    for (int n = 0; n < 4; ++n) tetrahedron[n] = numbers[tetrahedron[n]];
  }
  if (const std::size_t repeated = drop_repeated(mesh.tetrahedra); repeated > 0)
    header.notes.push_back(std::to_string(repeated) + " tetrahedra are there twice and are left out once");
  if (used < numbers.size())
    header.notes.push_back(std::to_string(numbers.size() - used) + " vertices are corners of no cell and are left out");
  return mesh;
}

MeshFile read(const FieldSource& source, bool must_be_decided) {
  check_mesh_options(source);
  const auto reader = open_mesh(source.path);
  MeshFile result;
  MeshFileHeader& header = result.header;
  header.format = reader->format;
  header.cells = reader->cells.counts();
  for (const MeshVectors& array : reader->arrays) header.arrays.push_back(name_of(*reader, array));
  header.notes = reader->notes;
  take_frame_and_units(*reader, source, header);
  const std::vector<glm::dvec3> displacement = displacement_of(*reader, source, header);
  require(!displacement.empty() || !must_be_decided,
          "which vectors are the displacement? " + source.path.string() + listed(*reader) +
              "; give displacement=NAME, step=N where there are several, deformed=FILE, or table=FILE, as in " +
              source.path.string() + ":displacement=NAME");
  result.mesh = mesh_of(*reader, displacement, source, header);
  if (header.lattice) result.lattice = *header.lattice;
  header.vertices = result.mesh.rest.size();
  header.tetrahedra = result.mesh.tetrahedra.size();
  return result;
}

}  // namespace

void check_mesh_options(const FieldSource& source) {
  const std::string file = source.path.string();
  for (const auto& [key, value] : source.options) {
    const bool free = key == "displacement" || key == "step" || key == "deformed" || key == "table";
    require(free || key == "frame" || key == "units",
            "the option \"" + key + "\" for " + file +
                "; a mesh takes displacement, step, deformed, table, frame and units");
    require(free || (key == "frame" ? value == "lps" || value == "ras" : value == "mm" || value == "m"),
            key + "=" + value + " for " + file + "; expected " +
                (key == "frame" ? "frame=lps or frame=ras" : "units=mm or units=m"));
  }
  if (source.options.contains("step")) step_of(source);
  const bool array = source.options.contains("displacement") || source.options.contains("step");
  const int ways =
      (array ? 1 : 0) + (source.options.contains("deformed") ? 1 : 0) + (source.options.contains("table") ? 1 : 0);
  require(ways <= 1,
          "deformed=, table= and displacement= or step= beside one another for " + file + "; give one of them");
}

bool is_mesh_file(const std::filesystem::path& path) {
  if (is_folder(path)) return false;
  const MeshFormat* format = format_of(path);
  return format != nullptr && (format->holds_mesh == nullptr || format->holds_mesh(path));
}

MeshFile read_mesh_file(const FieldSource& source) { return read(source, true); }

MeshFileHeader read_mesh_header(const FieldSource& source) { return read(source, false).header; }

}  // namespace tetwarp
