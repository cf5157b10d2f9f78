// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string_view>

namespace tetwarp::viewer {

/// A file of the page, as it is built into the program.
struct PageFile {
  std::string_view path;   ///< as the browser asks for it: "/view.js"
  std::string_view type;   ///< media type
  std::string_view bytes;  ///< content
};

/// All files of the page. "/" is its first one.
std::span<const PageFile> page_files();

}  // namespace tetwarp::viewer
