// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_xplt.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <span>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/meshes/model_builder.h"

namespace tetwarp {
namespace {

/// Chunks by their numbers (FEBioPlotFile.h of FEBio). A file is a tree of them: number, length, and so many bytes,
/// which are values or further chunks.
enum Chunk : std::uint32_t {
  kRoot = 0x01000000,
  kHeader = 0x01010000,
  kVersion = 0x01010001,
  kCompression = 0x01010004,
  kDictionary = 0x01020000,
  kItem = 0x01020001,
  kItemType = 0x01020002,
  kItemName = 0x01020004,
  kNodal = 0x01023000,
  kMesh = 0x01040000,
  kNodes = 0x01041000,
  kPlainCoordinates = 0x01041001,  // three numbers a node
  kNodeHeader = 0x01041100,
  kNodeCount = 0x01041101,
  kNodeDimension = 0x01041102,
  kCoordinates = 0x01041200,  // the number of a node, and its coordinates
  kDomains = 0x01042000,
  kDomain = 0x01042100,
  kDomainHeader = 0x01042101,
  kElementType = 0x01042102,
  kElements = 0x01042200,
  kElement = 0x01042201,
  kState = 0x02000000,
  kStateData = 0x02020000,
  kVariable = 0x02020001,
  kVariableNumber = 0x02020002,
  kVariableData = 0x02020003,
  kNodeData = 0x02020300,
};
constexpr std::uint32_t kMark = 0x00464542, kVec3f = 1;

/// An element, by its place in the list of FEBio's types.
struct XpltElement {
  std::size_t nodes;
  std::optional<CellShape> shape;
  const char* name;
};
constexpr std::array kElementTypes = std::to_array<XpltElement>({{8, CellShape::hexahedron, "hex8"},
                                                                 {6, CellShape::wedge, "penta6"},
                                                                 {4, CellShape::tetrahedron, "tet4"},
                                                                 {4, {}, "quad4"},
                                                                 {3, {}, "tri3"},
                                                                 {2, {}, "truss2"},
                                                                 {20, CellShape::hexahedron, "hex20"},
                                                                 {10, CellShape::tetrahedron, "tet10"},
                                                                 {15, CellShape::tetrahedron, "tet15"},
                                                                 {27, CellShape::hexahedron, "hex27"},
                                                                 {6, {}, "tri6"},
                                                                 {8, {}, "quad8"},
                                                                 {9, {}, "quad9"},
                                                                 {15, CellShape::wedge, "penta15"},
                                                                 {20, CellShape::tetrahedron, "tet20"},
                                                                 {10, {}, "tri10"},
                                                                 {5, CellShape::pyramid, "pyra5"},
                                                                 {5, CellShape::tetrahedron, "tet5"},
                                                                 {13, CellShape::pyramid, "pyra13"},
                                                                 {3, {}, "line3"}});

/// A chunk: what its number says, and where its bytes are.
struct Part {
  std::uint32_t kind = 0;
  std::uint64_t begin = 0, end = 0;

  std::uint64_t size() const { return end - begin; }
};

/// The bytes of a file, little-endian.
class Bytes {
 public:
  explicit Bytes(const std::filesystem::path& path)
      : file_(path.string()), size_(std::filesystem::file_size(path)), stream_(path, std::ios::binary) {}

  const std::string& file() const { return file_; }
  std::uint64_t size() const { return size_; }

  template <class T>
  std::vector<T> values(const Part& part) {
    static_assert(sizeof(T) == 4 && std::endian::native == std::endian::little);
    require(part.size() % sizeof(T) == 0, "a chunk of " + std::to_string(part.size()) + " bytes" + at(part));
    std::vector<T> values(part.size() / sizeof(T));
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(part.begin));
    stream_.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(part.size()));
    require(stream_.good() || values.empty(), "truncated" + at(part) + "; is the file whole?");
    return values;
  }
  std::uint32_t number(const Part& part) {
    require(part.size() == sizeof(std::uint32_t), "a number of " + std::to_string(part.size()) + " bytes" + at(part));
    return values<std::uint32_t>(part).front();
  }

  /// The chunk that begins at a byte, if one does before `end`. @throws InputError for one that ends behind it
  std::optional<Part> chunk_at(std::uint64_t byte, std::uint64_t end) {
    if (byte == end) return std::nullopt;
    constexpr std::uint64_t kHead = 8;
    const Part head{0, byte, byte + kHead};
    require(head.end <= end, "truncated" + at(head) + "; is the file whole?");
    const std::vector<std::uint32_t> words = values<std::uint32_t>(head);
    const Part part{words[0], head.end, head.end + words[1]};
    require(part.end <= end, "a chunk that does not fit" + at(head) + "; is the file whole?");
    return part;
  }
  /// Calls a function for each chunk inside another one.
  template <class Take>
  void each(const Part& parent, Take&& take) {
    std::uint64_t byte = parent.begin;
    while (const std::optional<Part> part = chunk_at(byte, parent.end)) {
      take(*part);
      byte = part->end;
    }
  }

 private:
  std::string at(const Part& part) const { return " at byte " + std::to_string(part.begin) + " of " + file_; }

  std::string file_;
  std::uint64_t size_;
  std::ifstream stream_;
};

class XpltReader final : public MeshReader {
 public:
  explicit XpltReader(const std::filesystem::path& path) : MeshReader(path), path_(path), model_(path.string()) {
    Bytes bytes(path);
    const Part mark{0, 0, sizeof(std::uint32_t)};
    require(bytes.size() >= mark.end && bytes.number(mark) == kMark,
            "no plot file of FEBio (it does not begin with BEF), " + bytes.file());
    bytes.each({0, mark.end, bytes.size()}, [&](const Part& part) {
      if (part.kind == kRoot)
        bytes.each(part, [&](const Part& inner) { take(bytes, inner); });
      else
        take(bytes, part);
    });
    require(has_mesh_, "no mesh, " + bytes.file() + "; is the file whole?");
    model_.build(*this);
    for (std::size_t state = 0; state < states_.size(); ++state) find_vectors(bytes, state);
  }

  std::vector<glm::dvec3> vectors(std::size_t n) const override {
    Bytes bytes(path_);
    const std::vector<float> values = bytes.values<float>(data_[n]);
    std::vector<glm::dvec3> result(points.size(), glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
    for (std::size_t node = 0; node < numbers_.size(); ++node) {
      glm::dvec3& vector = result[vertex_numbered(*this, numbers_[node], " in " + bytes.file())];
      for (std::size_t axis = 0; axis < 3; ++axis)
        vector[static_cast<int>(axis)] = static_cast<double>(values[3 * node + axis]);
    }
    return result;
  }

 private:
  /// Takes a chunk that lies at the top, or in the root: of FEBio 2 the mesh does, of later ones it lies behind.
  void take(Bytes& bytes, const Part& part) {
    if (part.kind == kHeader) take_header(bytes, part);
    if (part.kind == kDictionary) take_dictionary(bytes, part);
    if (part.kind == kMesh) take_mesh(bytes, part);
    if (part.kind == kState) states_.push_back(part);
  }

  void take_header(Bytes& bytes, const Part& header) {
    bytes.each(header, [&](const Part& part) {
      if (part.kind == kVersion) format = "FEBio plot file, version " + std::to_string(bytes.number(part));
      require(part.kind != kCompression || bytes.number(part) == 0,
              "a compressed plot file, " + bytes.file() + "; write it with <compression>0</compression>");
    });
  }

  /// Takes the names of the variables of nodes, which are counted from 1; no name of one that is no vector.
  void take_dictionary(Bytes& bytes, const Part& dictionary) {
    bytes.each(dictionary, [&](const Part& list) {
      if (list.kind != kNodal) return;
      bytes.each(list, [&](const Part& item) {
        if (item.kind != kItem) return;
        std::string name;
        bool is_vector = false;
        bytes.each(item, [&](const Part& part) {
          if (part.kind == kItemType) is_vector = bytes.number(part) == kVec3f;
          if (part.kind == kItemName) name = name_in(bytes.values<std::uint32_t>(part));
        });
        nodal_.push_back(is_vector ? name : "");
      });
    });
  }

  /// A name of 64 bytes, or with its length before it.
  static std::string name_in(const std::vector<std::uint32_t>& words) {
    if (words.empty()) return {};
    std::string text(words.size() * sizeof(std::uint32_t), '\0');
    std::memcpy(text.data(), words.data(), text.size());
    if (words[0] <= text.size() - sizeof(std::uint32_t)) text = text.substr(sizeof(std::uint32_t), words[0]);
    text.resize(std::min(text.find('\0'), text.size()));
    return text;
  }

  void take_mesh(Bytes& bytes, const Part& mesh) {
    require(!has_mesh_, "a second mesh, " + bytes.file() + "; a mesh that changes is not read");
    has_mesh_ = true;
    bytes.each(mesh, [&](const Part& part) {
      if (part.kind == kNodes) take_nodes(bytes, part);
      if (part.kind == kDomains) bytes.each(part, [&](const Part& domain) { take_domain(bytes, domain); });
    });
  }

  void take_nodes(Bytes& bytes, const Part& nodes) {
    std::size_t dimension = 3;
    bytes.each(nodes, [&](const Part& part) {
      if (part.kind == kNodeHeader) {
        bytes.each(part, [&](const Part& said) {
          if (said.kind == kNodeDimension) dimension = bytes.number(said);
        });
        require(dimension == 3, "nodes of " + std::to_string(dimension) + " coordinates, " + bytes.file());
      }
      if (part.kind != kPlainCoordinates && part.kind != kCoordinates) return;
      const std::size_t first = part.kind == kCoordinates ? 1 : 0, step = 3 + first;
      const std::vector<float> values = bytes.values<float>(part);
      require(values.size() % step == 0,
              std::to_string(values.size()) + " numbers of nodes, " + bytes.file() + "; is the file whole?");
      for (std::size_t at = 0; at < values.size(); at += step) {
        const auto place = static_cast<std::int64_t>(numbers_.size());
        numbers_.push_back(first == 1 ? std::bit_cast<std::int32_t>(values[at]) : place + 1);
        model_.add_node(numbers_.back(),
                        glm::dvec3(static_cast<double>(values[at + first]), static_cast<double>(values[at + first + 1]),
                                   static_cast<double>(values[at + first + 2])));
      }
    });
  }

  /// Takes the elements of a domain, which name their nodes by the place in the file, from 0.
  void take_domain(Bytes& bytes, const Part& domain) {
    if (domain.kind != kDomain) return;
    const XpltElement* type = nullptr;
    bytes.each(domain, [&](const Part& part) {
      if (part.kind == kDomainHeader) {
        bytes.each(part, [&](const Part& said) {
          if (said.kind != kElementType) return;
          const std::uint32_t number = bytes.number(said);
          require(number < kElementTypes.size(),
                  "elements of the type " + std::to_string(number) + ", " + bytes.file());
          type = &kElementTypes[number];
        });
      }
      if (part.kind != kElements) return;
      require(type != nullptr, "elements without a type, " + bytes.file());
      take_elements(bytes.values<std::uint32_t>(part), *type, bytes.file());
    });
  }

  /// Takes a list of chunks, an element each: its number and its nodes.
  void take_elements(const std::vector<std::uint32_t>& list, const XpltElement& type, const std::string& file) {
    const std::size_t length = 2 + 1 + type.nodes;  // with what begins each chunk: kind and bytes
    require(list.size() % length == 0, "elements " + std::string(type.name) + " of other lengths, " + file);
    for (std::size_t at = 0; at < list.size(); at += length) {
      require(list[at] == kElement && list[at + 1] == sizeof(std::uint32_t) * (length - 2),
              [&] { return "an element " + std::string(type.name) + " of another length, " + file; });
      take_element(std::span(list).subspan(at + 2, length - 2), type, file);
    }
  }

  void take_element(std::span<const std::uint32_t> words, const XpltElement& type, const std::string& file) {
    if (!type.shape) return model_.leave_out(type.name);
    std::vector<std::int64_t> corners;
    for (std::size_t n = 0; n < corner_count(*type.shape); ++n) {
      const std::uint32_t place = words[n + 1];
      require(place < numbers_.size(), [&] {
        return "an element with the node " + std::to_string(place) + ", " + file + "; there are " +
               std::to_string(numbers_.size());
      });
      corners.push_back(numbers_[place]);
    }
    model_.add_element(words[0], *type.shape, corners, type.nodes > corners.size());
  }

  /// Remembers where the vectors of nodes of a state are. States are counted from 0.
  void find_vectors(Bytes& bytes, std::size_t state) {
    bytes.each(states_[state], [&](const Part& data) {
      if (data.kind != kStateData) return;
      bytes.each(data, [&](const Part& list) {
        if (list.kind != kNodeData) return;
        bytes.each(list, [&](const Part& variable) {
          if (variable.kind == kVariable) find_variable(bytes, variable, state);
        });
      });
    });
  }

  void find_variable(Bytes& bytes, const Part& variable, std::size_t state) {
    std::size_t number = 0;
    bytes.each(variable, [&](const Part& part) {
      if (part.kind == kVariableNumber) number = bytes.number(part);
      if (part.kind != kVariableData || number < 1 || number > nodal_.size() || nodal_[number - 1].empty()) return;
      bytes.each(part, [&](const Part& region) {  // its kind is the number of a region: all nodes
        const std::uint64_t expected = 3 * sizeof(float) * numbers_.size();
        require(region.size() == expected, [&] {
          return "\"" + nodal_[number - 1].substr(0, 60) + "\" has " + std::to_string(region.size()) + " bytes, " +
                 bytes.file() + "; expected " + std::to_string(expected);
        });
        arrays.push_back({nodal_[number - 1], static_cast<std::int64_t>(state)});
        data_.push_back(region);
      });
    });
  }

  std::filesystem::path path_;
  ModelBuilder model_;
  bool has_mesh_ = false;
  std::vector<std::int64_t> numbers_;  ///< of the nodes, in the order of the file
  std::vector<std::string> nodal_;     ///< names of the variables of nodes; empty: no vector
  std::vector<Part> states_;
  std::vector<Part> data_;  ///< for each of `arrays`
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return lower(path.extension().string()) == ".xplt";
}

std::unique_ptr<MeshReader> open(const std::filesystem::path& path) { return std::make_unique<XpltReader>(path); }

}  // namespace

const MeshFormat kMeshFormat_xplt = {".xplt", recognizes, nullptr, open};

}  // namespace tetwarp
