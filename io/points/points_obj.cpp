// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads Wavefront OBJ surfaces. Vertex normals are no longer true after a deformation, so `vn` lines and references to
// them are left out.

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/points/points_document.h"

namespace tetwarp {

namespace {

class ObjDocument : public PointsDocument {
 public:
  ObjDocument(std::string all, const std::string& name) : bytes_(std::move(all)) {
    Lines lines(bytes_);
    bool dropped = false;
    while (lines.next()) {
      const auto words = words_of(lines.line);
      if (words.empty()) continue;
      const std::string where = at_line(lines.number, name);
      if (words[0].starts_with('#')) {
        take_space(lines.line, name);
        continue;
      }
      const bool known = words[0] == "v" || words[0] == "vn" || words[0] == "f";
      require(!known || words.back() != "\\", "a line that goes on in the next" + where + "; join the two");
      if (words[0] == "v") take_vertex(words, where);
      if (words[0] == "f") take_face(words, where);
      if (words[0] == "vn") {
        edits_.push_back({{lines.begin, lines.begin + lines.whole.size()}, ""});
        dropped = true;
      }
    }
    require(largest_ <= points.size(), "a face with vertex " + std::to_string(largest_) + " of " +
                                           std::to_string(points.size()) + ", " + name + "; is the file whole?");
    if (dropped) notes.push_back(name + ": its vertex normals do not hold any more and are left out");
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus>) const override {
    Patch patch(bytes_);
    std::size_t vertex = 0;
    for (const Edit& edit : edits_) {
      if (edit.is_vertex) {
        patch.replace(edit.at.begin, edit.at.end, text_of(moved[vertex++]));
      } else {
        patch.replace(edit.at.begin, edit.at.end, edit.text);
      }
    }
    return patch.take();
  }

 private:
  struct Edit {
    TextSpan at;
    std::string text;
    bool is_vertex = false;
  };

  TextSpan span_of(std::string_view first, std::string_view last) const {
    return {static_cast<std::size_t>(first.data() - bytes_.data()),
            static_cast<std::size_t>(last.data() + last.size() - bytes_.data())};
  }

  void take_vertex(const std::vector<std::string_view>& words, const std::string& where) {
    require(words.size() >= 4, std::to_string(words.size() - 1) + " coordinates" + where + "; expected 3");
    points.emplace_back(number_of(words[1], where), number_of(words[2], where), number_of(words[3], where));
    edits_.push_back({span_of(words[1], words[3]), {}, true});
  }

  /// Takes a face, `f 1/2/3 ...`, `f 1//3 ...`, `f 1/2 ...` or `f 1 ...`. Negative numbers count back from the last
  /// vertex.
  void take_face(const std::vector<std::string_view>& words, const std::string& where) {
    for (std::size_t n = 1; n < words.size(); ++n) {
      const std::string_view word = words[n];
      const std::size_t slash = word.find('/');
      const std::int64_t vertex = number_from<std::int64_t>(word.substr(0, slash)).value_or(0);
      require(vertex != 0, "\"" + std::string(word) + "\" where a vertex number is expected" + where);
      require(vertex > 0 || static_cast<std::size_t>(-vertex) <= points.size(),
              "a face with vertex " + std::to_string(vertex) + " after " + std::to_string(points.size()) + where);
      largest_ = std::max(largest_, static_cast<std::size_t>(std::max<std::int64_t>(vertex, 0)));
      const std::size_t second = slash == std::string_view::npos ? slash : word.find('/', slash + 1);
      if (second == std::string_view::npos) continue;
      const bool texture = second > slash + 1;
      edits_.push_back({span_of(word, word), std::string(word.substr(0, texture ? second : slash))});
    }
  }

  std::string bytes_;
  std::vector<Edit> edits_;  ///< what is replaced, in the order of the file
  std::size_t largest_ = 0;  ///< the largest number of a vertex in a face
};

}  // namespace

std::unique_ptr<PointsDocument> parse_obj_points(std::string bytes, const std::string& name) {
  return std::make_unique<ObjDocument>(std::move(bytes), name);
}

}  // namespace tetwarp
