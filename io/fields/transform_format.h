// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what transform_file.cpp knows of the formats that it reads. A format is a pair of files, a word of
// CMake and a test.
#include <filesystem>
#include <stop_token>
#include <string_view>
#include <vector>

#include "io/transform_file.h"

namespace tetwarp {

struct TransformFormat {
  /// Whether a file is of this format, by its suffix or its first bytes (`kFirstBytes` of them; fewer of a shorter
  /// file, none where it cannot be read).
  bool (*recognizes)(const std::filesystem::path& path, std::string_view first_bytes);
  /// Whether a recognized file holds a transform, by a quick look; null: it always does. It does not throw.
  bool (*holds_transform)(const std::filesystem::path& path);
  /// Checks the options but `invert`, which all formats have; null: there are no others.
  /// @throws InputError naming the file and what to give
  void (*check_options)(const FieldSource& source);
  /// @throws InputError naming the file; Cancelled
  TransformFile (*read)(const FieldSource& source, const std::stop_token& stop);
  /// Adds the files that are read besides the file itself; null: there are none. @throws InputError for a missing one
  void (*add_files)(const FieldSource& source, std::vector<std::filesystem::path>& files);
};

/// The first format that recognizes the file and says that it holds a transform, in the order of io/CMakeLists.txt,
/// from which this function is made; null: none does.
const TransformFormat* find_transform_format(const std::filesystem::path& path, std::string_view first_bytes);

/// A transform that is affine, as the map of points that it is in LPS mm.
TransformFile affine_transform(const AffineMap& map);

}  // namespace tetwarp
