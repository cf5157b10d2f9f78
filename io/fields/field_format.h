// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the seam between field_file.cpp and the formats that it reads. docs/guide/new-format.md shows
// what one more takes: a pair of files, a line of CMake, a test.
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "io/field_file.h"

namespace tetwarp {

/// How much of a file is looked at to know its format: DICOM's mark is at 128.
inline constexpr std::size_t kFirstBytes = 132;

/// A field file whose header was read and found to fit the file's length.
class FieldReader {
 public:
  explicit FieldReader(FieldFileHeader header) : header_(std::move(header)) {}
  virtual ~FieldReader() = default;

  const FieldFileHeader& header() const { return header_; }
  /// Fills one displacement a vertex of `header().grid`, i fastest: LPS mm, relative, whatever the file has.
  /// @throws InputError for a file that is truncated or damaged; numbers that are not finite pass through
  virtual void read(std::span<glm::vec3> displacement) const = 0;

 protected:
  FieldFileHeader header_;
};

struct FieldFormat {
  /// Whether the file is of this format, by its suffix or its first bytes (up to `kFirstBytes`; fewer of a
  /// shorter file, none where it cannot be read).
  bool (*claims)(const std::filesystem::path& path, std::string_view first_bytes);
  /// Whether a claimed file holds a field rather than a volume; null: always. @throws InputError as `open`
  bool (*holds_field)(const FieldSource& source);
  /// @throws InputError naming the file and what to give; null: the format takes no options
  void (*check_options)(const FieldSource& source);
  /// Reads and checks the header; allocates nothing that the file's length does not warrant. @throws InputError
  std::unique_ptr<FieldReader> (*open)(const FieldSource& source);
};

/// Of all formats, in the order of io/CMakeLists.txt (the file is made there), the first that claims the file; null:
/// none.
const FieldFormat* find_field_format(const std::filesystem::path& path, std::string_view first_bytes);

}  // namespace tetwarp
