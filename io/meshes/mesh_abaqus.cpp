// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_abaqus.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/meshes/model_builder.h"

namespace tetwarp {
namespace {

/// A solid element, by the beginning of its name behind C3D: letters behind it say how it is integrated.
struct Solid {
  std::string_view nodes;
  CellShape shape;
  std::size_t count;
};
constexpr std::array<Solid, 8> kSolids = {{{"4", CellShape::tetrahedron, 4},
                                           {"10", CellShape::tetrahedron, 10},
                                           {"5", CellShape::pyramid, 5},
                                           {"13", CellShape::pyramid, 13},
                                           {"6", CellShape::wedge, 6},
                                           {"15", CellShape::wedge, 15},
                                           {"8", CellShape::hexahedron, 8},
                                           {"20", CellShape::hexahedron, 20}}};

/// The solid that a type names; null: it is none. @throws InputError for a solid that is not known
const Solid* solid_of(const std::string& type, const std::string& where) {
  if (!type.starts_with("c3d")) return nullptr;
  const std::string_view rest = std::string_view(type).substr(3);
  const std::string_view digits = rest.substr(0, std::min(rest.find_first_not_of("0123456789"), rest.size()));
  const auto* found = std::ranges::find(kSolids, digits, &Solid::nodes);
  require(found != kSolids.end(),
          "elements of the type " + type + where + "; expected C3D4, C3D5, C3D6, C3D8, C3D10, C3D13, C3D15 or C3D20");
  return found;
}

std::vector<std::string_view> split_at_commas(std::string_view line) {
  std::vector<std::string_view> parts;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t comma = std::min(line.find(',', at), line.size());
    parts.push_back(line.substr(at, comma - at));
    at = comma + 1;
  }
  return parts;
}

std::string compact_lower(std::string_view text) {
  std::string compact = lower(std::string(text));
  std::erase_if(compact, [](unsigned char c) { return std::isspace(c) != 0; });
  return compact;
}

/// Whether a line goes on in the next one.
bool ends_with_comma(std::string_view line) {
  const std::size_t last = line.find_last_not_of(" \t\r");
  return last != std::string_view::npos && line[last] == ',';
}

class AbaqusReader final : public MeshReader {
 public:
  explicit AbaqusReader(const std::filesystem::path& path) : MeshReader(path), file_(path.string()), model_(file_) {
    format = "Abaqus input";
    std::ifstream stream(path, std::ios::binary);
    const auto next = [&](std::string& line) {
      ++number_;
      return static_cast<bool>(std::getline(stream, line));
    };
    for (std::string line; next(line);) {
      if (line.starts_with("**") || line.find_first_not_of(" \t\r") == std::string::npos) continue;
      for (std::string more; line.front() == '*' && ends_with_comma(line) && next(more);) line += more;
      if (line.front() == '*')
        take_keyword(line);
      else
        take_data(line);
    }
    end_element();
    model_.build(*this);
  }

  std::vector<glm::dvec3> vectors(std::size_t) const override { return {}; }  // a model has none

 private:
  enum class Block : std::uint8_t { other, nodes, elements };

  std::string here() const { return " in line " + std::to_string(number_) + " of " + file_; }

  void take_keyword(const std::string& line) {
    end_element();
    std::vector<std::string> words;
    for (const std::string_view part : split_at_commas(line)) words.push_back(compact_lower(part));
    const std::string& keyword = words.front();
    const std::array<std::string_view, 9> refused = {"*include", "*ngen", "*nfill",        "*ncopy", "*elgen",
                                                     "*elcopy",  "*nmap", "*imperfection", "*system"};
    require(std::ranges::find(refused, keyword) == refused.end(),
            keyword + here() + " is not read; write a model with all nodes and elements in it");
    parts_ += keyword == "*part" ? 1 : 0;
    require(parts_ <= 1, "a second *PART" + here() + "; write a model of one part");
    // What an assembly adds, such as reference points, has numbers of its own.
    if (keyword == "*assembly" || keyword == "*endassembly") in_assembly_ = keyword == "*assembly";
    in_instance_ = keyword == "*instance";
    block_ = Block::other;
    if (!in_assembly_ && keyword == "*node") block_ = Block::nodes;
    if (!in_assembly_ && keyword == "*element") block_ = Block::elements;
    if (block_ == Block::other) return;
    std::string type;
    for (std::size_t n = 1; n < words.size(); ++n) {
      if (words[n].starts_with("type=")) type = words[n].substr(5);
      require(!words[n].starts_with("system=") || words[n] == "system=r",
              words[n] + ", a coordinate system of its own," + here() + "; expected rectangular coordinates (R)");
      require(!words[n].starts_with("input="), words[n] + here() + " is not read; write the model as one file");
    }
    if (block_ == Block::nodes) return;
    require(!type.empty(), "*ELEMENT without TYPE=" + here());
    type_ = type;
    solid_ = solid_of(type, here());
  }

  void take_data(const std::string& line) {
    require(!in_instance_, "an *INSTANCE that is moved" + here() + "; write a model in its own coordinates");
    if (block_ == Block::nodes) return take_node(line);
    if (block_ == Block::elements) take_element(line);
  }

  void take_node(const std::string& line) {
    const std::vector<std::string_view> words = split_at_commas(line);
    require(words.size() >= 4,
            std::to_string(words.size()) + " values of a node" + here() + "; expected its number and x, y, z");
    model_.add_node(whole_in(words[0], here()),
                    {real_in(words[1], here()), real_in(words[2], here()), real_in(words[3], here())});
  }

  void take_element(const std::string& line) {
    if (!solid_) {
      // A line that ends with a comma goes on in the next, which is no element of its own.
      if (!goes_on_) model_.leave_out(upper_type());
      goes_on_ = ends_with_comma(line);
      return;
    }
    for (const std::string_view word : split_at_commas(line)) {
      if (word.find_first_not_of(" \t\r") == std::string_view::npos) continue;  // behind the last comma
      values_.push_back(whole_in(word, here()));
      require(values_.size() <= solid_->count + 1, "too many nodes of an element " + upper_type() + here());
    }
    if (values_.size() == solid_->count + 1) end_element();
  }

  /// Adds the element whose values are complete. @throws InputError for one that is not
  void end_element() {
    goes_on_ = false;
    if (values_.empty()) return;
    require(values_.size() == solid_->count + 1, "an element " + upper_type() + " of " +
                                                     std::to_string(values_.size() - 1) + " nodes before line " +
                                                     std::to_string(number_) + " of " + file_ + "; is the file whole?");
    const std::size_t corners = corner_count(solid_->shape);
    model_.add_element(values_[0], solid_->shape, std::span(values_).subspan(1, corners), solid_->count > corners);
    values_.clear();
  }

  std::string upper_type() const {
    std::string upper = type_;
    std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return upper;
  }

  std::string file_;
  ModelBuilder model_;
  std::int64_t number_ = 0;  ///< of the line
  Block block_ = Block::other;
  bool in_assembly_ = false, in_instance_ = false, goes_on_ = false;
  int parts_ = 0;
  std::string type_;
  const Solid* solid_ = nullptr;
  std::vector<std::int64_t> values_;  ///< of the element that is being read
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return lower(path.extension().string()) == ".inp";
}

std::unique_ptr<MeshReader> open(const std::filesystem::path& path) { return std::make_unique<AbaqusReader>(path); }

}  // namespace

const MeshFormat kMeshFormat_abaqus = {".inp", recognizes, nullptr, open};

}  // namespace tetwarp
