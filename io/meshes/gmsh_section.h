// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the sections of a Gmsh file and the numbers in them.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// How a Gmsh file writes numbers, by its $MeshFormat.
struct GmshForm {
  double version = 0;
  bool binary = false, swapped = false;  ///< `swapped`: the file has the other byte order than this machine
  std::size_t size_bytes = 8;            ///< bytes of a size_t in a binary file
  /// In MSH 4.1 tags are size_t, in other versions int.
  bool tags_are_sizes = false;
};

/// A section of a Gmsh file: the bytes between $NAME and $EndNAME.
struct GmshSection {
  std::string name;
  std::size_t begin = 0, end = 0;
};

/// All sections of a file in their order; the first is MeshFormat. @throws InputError for a section that does not end
std::vector<GmshSection> gmsh_sections(std::string_view bytes, const std::string& file);

/// Takes the numbers of a section one by one. Every function throws InputError naming file and byte where the section
/// ends too early or has something else.
class GmshNumbers {
 public:
  GmshNumbers(std::string_view bytes, const GmshSection& section, GmshForm form, std::string file)
      : bytes_(bytes.substr(0, section.end)),
        name_(section.name),
        file_(std::move(file)),
        form_(form),
        at_(section.begin) {}

  /// Takes an int: 4 bytes in a binary file.
  std::int64_t integer();
  /// Takes a size_t.
  std::uint64_t size();
  /// Takes a double; it may be NaN or infinite.
  double real();
  /// Takes the tag of a node or an element: a size_t or an int.
  std::uint64_t tag();
  /// Takes what is left of the line.
  std::string line();
  /// Takes an integer that is written as text in a binary file, too.
  std::int64_t text_integer();
  /// Skips `count` tags.
  void skip_tags(std::uint64_t count);

  /// Checks that the section has room for so many items, before memory for them is allocated.
  /// @param items  number of items
  /// @param tags   tags of one item
  /// @param reals  real numbers of one item
  void require_room(std::uint64_t items, std::uint64_t tags, std::uint64_t reals) const;
  void require_end();
  std::string here() const;
  /// Reads the numbers from here on in another form.
  GmshNumbers in(const GmshForm& form) const;

 private:
  std::string_view word();
  [[noreturn]] void refuse_end() const;
  std::size_t tag_bytes() const;
  template <class Number>
  Number raw();
  template <class Number>
  Number parsed();

  std::string_view bytes_;
  std::string name_, file_;
  GmshForm form_;
  std::size_t at_;
};

/// Reads the section MeshFormat. @throws InputError for a version that is not read
GmshForm gmsh_form(std::string_view bytes, const GmshSection& section, const std::string& file);

}  // namespace tetwarp
