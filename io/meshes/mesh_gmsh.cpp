// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_gmsh.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>
#include <sstream>
#include <utility>

#include "deform/errors.h"
#include "io/images/image_reader.h"
#include "io/meshes/gmsh_section.h"

namespace tetwarp {
namespace {

/// A type of element, by its number in Gmsh's manual.
struct ElementType {
  std::int64_t number;
  std::size_t nodes;
  int order = 1;  ///< of the element's shape functions
  /// The solid whose corners are the first nodes of the element; empty: the element has no volume.
  std::optional<CellShape> shape;
};

constexpr auto kTet = CellShape::tetrahedron;
constexpr auto kHex = CellShape::hexahedron;
constexpr auto kWedge = CellShape::wedge;
constexpr auto kPyramid = CellShape::pyramid;
constexpr std::array kElementTypes = std::to_array<ElementType>(
    {{4, 4, 1, kTet},       {5, 8, 1, kHex},     {6, 6, 1, kWedge},     {7, 5, 1, kPyramid},    {11, 10, 2, kTet},
     {12, 27, 2, kHex},     {13, 18, 2, kWedge}, {14, 14, 2, kPyramid}, {17, 20, 2, kHex},      {18, 15, 2, kWedge},
     {19, 13, 2, kPyramid}, {29, 20, 3, kTet},   {30, 35, 4, kTet},     {31, 56, 5, kTet},      {90, 40, 3, kWedge},
     {91, 75, 4, kWedge},   {92, 64, 3, kHex},   {93, 125, 4, kHex},    {118, 30, 3, kPyramid}, {119, 55, 4, kPyramid},
     {1, 2, 1, {}},         {2, 3, 1, {}},       {3, 4, 1, {}},         {8, 3, 2, {}},          {9, 6, 2, {}},
     {10, 9, 2, {}},        {15, 1, 1, {}},      {16, 8, 2, {}},        {20, 9, 3, {}},         {21, 10, 3, {}},
     {22, 12, 4, {}},       {23, 15, 4, {}},     {24, 15, 5, {}},       {25, 21, 5, {}},        {26, 4, 3, {}},
     {27, 5, 4, {}},        {28, 6, 5, {}},      {36, 16, 3, {}},       {37, 25, 4, {}},        {38, 36, 5, {}},
     {39, 12, 3, {}}});

/// Takes the number of a type. @return its index in kElementTypes
std::size_t take_type(GmshNumbers& numbers) {
  const std::int64_t number = numbers.integer();
  const auto* found = std::find_if(kElementTypes.begin(), kElementTypes.end(),
                                   [&](const ElementType& type) { return type.number == number; });
  if (found == kElementTypes.end()) {
    throw InputError("elements of the type " + std::to_string(number) + numbers.here() +
                     "; save the mesh with Gmsh at Mesh.ElementOrder = 1");
  }
  return static_cast<std::size_t>(found - kElementTypes.begin());
}

/// The header of a section $NodeData.
struct NodeData {
  GmshNumbers values;  ///< continues at the first value
  std::uint64_t count;
};

class GmshReader final : public MeshReader {
 public:
  GmshReader(const std::filesystem::path& path, std::string bytes)
      : MeshReader(path), bytes_(std::move(bytes)), file_(path.string()) {
    const std::vector<GmshSection> sections = gmsh_sections(bytes_, file_);
    form_ = gmsh_form(bytes_, sections[0], file_);
    format = std::string("Gmsh MSH ") +
             (form_.version == 4.1 ? "4.1"
              : form_.version == 4 ? "4.0"
                                   : "2") +
             (form_.binary ? ", binary" : ", text");
    take_nodes(the_section(sections, "Nodes"));
    take_elements(the_section(sections, "Elements"));
    std::uint64_t other_data = 0;
    for (const GmshSection& section : sections) {
      if (section.name == "NodeData") take_node_data(section);
      if (section.name == "ElementNodeData" || section.name == "ElementData") ++other_data;
    }
    if (other_data > 0)
      notes.push_back(std::to_string(other_data) +
                      " sections of data at the elements are left out; only data at the nodes are read");
  }

  std::vector<glm::dvec3> vectors(std::size_t n) const override {
    GmshNumbers values = data_[n].values;
    std::vector<glm::dvec3> result(points.size(), glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
    std::vector<bool> seen(points.size());
    for (std::uint64_t i = 0; i < data_[n].count; ++i) {
      const std::uint64_t tag = values.tag();
      const std::uint32_t vertex = vertex_of(tag, values);
      if (seen[vertex]) throw InputError("the node " + std::to_string(tag) + " is there twice" + values.here());
      seen[vertex] = true;
      for (int axis = 0; axis < 3; ++axis) result[vertex][axis] = values.real();
    }
    values.require_end();
    return result;
  }

 private:
  GmshNumbers the_section(const std::vector<GmshSection>& sections, const std::string& name) const {
    const GmshSection* found = nullptr;
    for (const GmshSection& section : sections) {
      if (section.name != name) continue;
      require(found == nullptr, "two sections $" + name + ", " + file_ + "; save the mesh as one file with one mesh");
      found = &section;
    }
    const bool parametric = std::any_of(sections.begin(), sections.end(),
                                        [](const GmshSection& section) { return section.name == "ParametricNodes"; });
    require(found != nullptr,
            "no section $" + name + ", " + file_ +
                (parametric ? " but $ParametricNodes; save the mesh with Gmsh at Mesh.SaveParametric = 0"
                            : "; is the file whole?"));
    return {bytes_, *found, form_, file_};
  }

  bool is_4() const { return form_.version >= 4; }

  /// How many blocks and items a section of elements or nodes has; it begins with these.
  struct Counts {
    std::uint64_t blocks = 1, items = 0;
  };
  Counts take_counts(GmshNumbers& numbers) const {
    Counts counts;
    if (!is_4()) {
      counts.items = static_cast<std::uint64_t>(std::max<std::int64_t>(0, numbers.text_integer()));
      numbers.line();
      return counts;
    }
    counts.blocks = numbers.size();
    counts.items = numbers.size();
    if (form_.version == 4.1) {  // skips the lowest and the highest tag
      numbers.size();
      numbers.size();
    }
    return counts;
  }

  /// Takes what a block says of its entity. @return the dimension of the entity
  std::int64_t take_entity(GmshNumbers& numbers) const {
    const std::int64_t first = numbers.integer(), second = numbers.integer();
    return form_.version == 4.1 ? first : second;
  }

  void take_point(GmshNumbers& numbers, std::int64_t parameters) {
    glm::dvec3 point;
    for (int axis = 0; axis < 3; ++axis) point[axis] = numbers.real();
    for (std::int64_t n = 0; n < parameters; ++n) numbers.real();
    points.push_back(point);
  }

  void take_nodes(GmshNumbers numbers) {
    const Counts counts = take_counts(numbers);
    numbers.require_room(counts.items, 1, 3);
    require(counts.items < std::numeric_limits<std::uint32_t>::max(),
            std::to_string(counts.items) + " nodes, " + file_ + "; expected fewer than 2^32 - 1");
    tags.reserve(counts.items);
    points.reserve(counts.items);
    for (std::uint64_t block = 0; block < counts.blocks; ++block) {
      std::int64_t parameters = 0;
      std::uint64_t nodes = counts.items;
      if (is_4()) {
        const std::int64_t dimension = take_entity(numbers), parametric = numbers.integer();
        require(dimension >= 0 && dimension <= 3 && (parametric == 0 || parametric == 1),
                "a block of nodes of dimension " + std::to_string(dimension) + ", parametric " +
                    std::to_string(parametric) + numbers.here());
        parameters = parametric == 1 && (form_.version == 4.1 || dimension < 3) ? dimension : 0;
        nodes = numbers.size();
        require(nodes <= counts.items - points.size(),
                "more nodes than " + std::to_string(counts.items) + numbers.here());
      }
      if (form_.version == 4.1)
        for (std::uint64_t n = 0; n < nodes; ++n) tags.push_back(numbers.tag());
      for (std::uint64_t n = 0; n < nodes; ++n) {
        if (form_.version != 4.1) tags.push_back(numbers.tag());
        take_point(numbers, parameters);
      }
    }
    require(points.size() == counts.items, std::to_string(points.size()) + " of " + std::to_string(counts.items) +
                                               " nodes" + numbers.here() + "; is the file whole?");
    numbers.require_end();
    sort_nodes();
  }

  /// Sorts the nodes by their tags, so that the numbers of vertices do not depend on the order of the file.
  void sort_nodes() {
    if (!std::is_sorted(tags.begin(), tags.end())) {
      std::vector<std::uint32_t> order(tags.size());
      std::iota(order.begin(), order.end(), 0U);
      std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return tags[a] < tags[b]; });
      std::vector<glm::dvec3> sorted(points.size());
      for (std::size_t n = 0; n < order.size(); ++n) sorted[n] = points[order[n]];
      points = std::move(sorted);
      std::sort(tags.begin(), tags.end());
    }
    const auto twice = std::adjacent_find(tags.begin(), tags.end());
    if (twice != tags.end()) throw InputError("the node " + std::to_string(*twice) + " is there twice, " + file_);
  }

  std::uint32_t vertex_of(std::uint64_t tag, const GmshNumbers& numbers) const {
    if (!tags.empty() && tag >= tags[0] && tag - tags[0] < tags.size() && tags[tag - tags[0]] == tag)
      return static_cast<std::uint32_t>(tag - tags[0]);  // no tag is missing below this one, so it gives the number
    const auto found = std::lower_bound(tags.begin(), tags.end(), tag);
    if (found == tags.end() || *found != tag)
      throw InputError("the node " + std::to_string(tag) + " is not in $Nodes, but" + numbers.here());
    return static_cast<std::uint32_t>(found - tags.begin());
  }

  void take_elements(GmshNumbers numbers) {
    const Counts counts = take_counts(numbers);
    std::uint64_t seen = 0;
    if (is_4()) {
      for (std::uint64_t block = 0; block < counts.blocks; ++block) {
        take_entity(numbers);
        const std::size_t type = take_type(numbers);
        const std::uint64_t elements = numbers.size();
        require(elements <= counts.items - seen, "more elements than " + std::to_string(counts.items) + numbers.here());
        take_block(numbers, type, elements, 0);
        seen += elements;
      }
    } else if (form_.binary) {
      while (seen < counts.items) {
        const std::size_t type = take_type(numbers);
        const std::uint64_t elements = numbers.tag(), element_tags = numbers.tag();
        require(elements > 0 && elements <= counts.items - seen, std::to_string(elements) + " elements where " +
                                                                     std::to_string(counts.items - seen) + " are left" +
                                                                     numbers.here());
        take_block(numbers, type, elements, element_tags);
        seen += elements;
      }
    } else {
      for (; seen < counts.items; ++seen) take_text_element(numbers);
    }
    require(seen == counts.items, std::to_string(seen) + " of " + std::to_string(counts.items) + " elements" +
                                      numbers.here() + "; is the file whole?");
    numbers.require_end();
    check_element_tags();
    note_elements();
  }

  /// Takes a block of elements of one type.
  /// @param element_tags  how many tags of an element come before its nodes (physical and elementary entity)
  void take_block(GmshNumbers& numbers, std::size_t n_type, std::uint64_t elements, std::uint64_t element_tags) {
    const ElementType& type = kElementTypes[n_type];
    numbers.require_room(elements, 1 + element_tags + type.nodes, 0);
    seen_[n_type] += elements;
    if (!type.shape) return numbers.skip_tags(elements * (1 + element_tags + type.nodes));
    for (std::uint64_t n = 0; n < elements; ++n) {
      const std::uint64_t element = numbers.tag();
      numbers.skip_tags(element_tags);
      take_element(numbers, type, element);
    }
  }

  /// Takes an element of MSH 2, which states its own type and number of tags.
  void take_text_element(GmshNumbers& numbers) {
    const std::uint64_t element = numbers.tag();
    const std::size_t n_type = take_type(numbers);
    const ElementType& type = kElementTypes[n_type];
    numbers.skip_tags(numbers.tag());
    ++seen_[n_type];
    if (!type.shape) return numbers.skip_tags(type.nodes);
    take_element(numbers, type, element);
  }

  void take_element(GmshNumbers& numbers, const ElementType& type, std::uint64_t element) {
    std::array<std::uint32_t, 8> corners{};
    const std::size_t count = corner_count(*type.shape);
    for (std::size_t n = 0; n < count; ++n) corners[n] = vertex_of(numbers.tag(), numbers);
    numbers.skip_tags(type.nodes - count);
    if (type.shape == CellShape::wedge) {  // Gmsh's first triangle looks inwards, VTK's outwards
      std::swap(corners[1], corners[2]);
      std::swap(corners[4], corners[5]);
    }
    cells.add(*type.shape, std::span(corners).first(count), element);
    element_tags_.push_back(element);
  }

  void check_element_tags() {
    std::sort(element_tags_.begin(), element_tags_.end());
    const auto twice = std::adjacent_find(element_tags_.begin(), element_tags_.end());
    if (twice != element_tags_.end())
      throw InputError("the element " + std::to_string(*twice) + " is there twice, " + file_);
    element_tags_ = {};
  }

  void note_elements() {
    std::uint64_t flat = 0;
    std::map<int, std::uint64_t> curved;
    for (std::size_t n = 0; n < kElementTypes.size(); ++n) {
      const ElementType& type = kElementTypes[n];
      if (!type.shape)
        flat += seen_[n];
      else if (type.order > 1 && seen_[n] > 0)
        curved[type.order] += seen_[n];
    }
    for (const auto& [order, elements] : curved) {
      notes.push_back(std::to_string(elements) +
                      (order == 2 ? " quadratic cells" : " cells of order " + std::to_string(order)) +
                      " are made linear: only their corners are used");
    }
    if (flat > 0) notes.push_back(std::to_string(flat) + " points, lines and surface elements are left out");
  }

  void take_node_data(const GmshSection& section) {
    GmshForm text = form_;
    text.binary = false;
    GmshNumbers header(bytes_, section, text, file_);
    const std::int64_t texts = header.text_integer();
    header.line();
    std::string name;
    for (std::int64_t n = 0; n < texts; ++n) {
      header.require_room(1, 1, 0);
      const std::string line = header.line();
      if (n == 0) name = unquoted(line);
    }
    for (std::int64_t reals = header.text_integer(); reals > 0; --reals) header.real();
    std::vector<std::int64_t> integers;
    for (std::int64_t left = header.text_integer(); left > 0; --left) integers.push_back(header.text_integer());
    require(integers.size() >= 3 && integers[2] >= 0, "no step, components and number of values" + header.here());
    header.line();
    if (integers[1] != 3) return;
    const auto count = static_cast<std::uint64_t>(integers[2]);
    GmshForm form = form_;
    form.tags_are_sizes = false;
    const GmshNumbers values = header.in(form);
    values.require_room(count, 1, 3);
    arrays.push_back({name, integers[0]});
    data_.push_back({values, count});
  }

  static std::string unquoted(const std::string& line) {
    const std::size_t first = line.find('"'), last = line.rfind('"');
    return first == last ? line : line.substr(first + 1, last - first - 1);
  }

  std::string bytes_, file_;
  GmshForm form_;
  /// By type of element: how many there are.
  std::array<std::uint64_t, kElementTypes.size()> seen_{};
  std::vector<std::uint64_t> element_tags_;  ///< tags of the elements that have a volume
  std::vector<NodeData> data_;               ///< for each of `arrays`, where its values are
};

bool recognizes(const std::filesystem::path& path, std::string_view first_bytes) {
  return path.extension() == ".msh" || first_bytes.starts_with("$MeshFormat");
}

std::unique_ptr<MeshReader> open(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(std::filesystem::file_size(path), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  require(stream.good(), "cannot be read whole, " + path.string());
  return std::make_unique<GmshReader>(path, std::move(bytes));
}

}  // namespace

const MeshFormat kMeshFormat_gmsh = {".msh", recognizes, nullptr, open};

}  // namespace tetwarp
