// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what field_file.cpp knows of the formats that it reads. docs/guide/new-format.md shows what a further
// format takes: a pair of files, a line of CMake, a test.
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "io/field_file.h"

namespace tetwarp {

/// How many bytes of a file are looked at to know its format; DICOM's mark is at 128.
inline constexpr std::size_t kFirstBytes = 132;

/// A field file whose header was read and fits the file's length.
class FieldReader {
 public:
  explicit FieldReader(FieldFileHeader header) : header_(std::move(header)) {}
  virtual ~FieldReader() = default;

  const FieldFileHeader& header() const { return header_; }
  /// Fills one displacement for each vertex of `header().grid`, i fastest: LPS mm and relative to the vertex, whatever
  /// the file has.
  /// @throws InputError for a file that is truncated or damaged; numbers that are not finite pass through
  virtual void read(std::span<glm::vec3> displacement) const = 0;

 protected:
  FieldFileHeader header_;
};

struct FieldFormat {
  /// Whether a file is of this format, by its suffix or its first bytes (`kFirstBytes` of them; fewer of a shorter
  /// file, none where it cannot be read).
  bool (*recognizes)(const std::filesystem::path& path, std::string_view first_bytes);
  /// Whether a recognized file holds a field rather than a volume; null: it always does. @throws InputError for what
  /// `open` refuses
  bool (*holds_field)(const FieldSource& source);
  /// Checks the options; null: the format takes none. @throws InputError naming the file and what to give
  void (*check_options)(const FieldSource& source);
  /// Reads and checks the header. It allocates no more than the file's length warrants. @throws InputError
  std::unique_ptr<FieldReader> (*open)(const FieldSource& source);
};

/// The first format that recognizes the file, in the order of io/CMakeLists.txt, from which this function is made;
/// null: none does.
const FieldFormat* find_field_format(const std::filesystem::path& path, std::string_view first_bytes);

}  // namespace tetwarp
