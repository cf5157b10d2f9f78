// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace tetwarp {

/// Text from a file, or a name, the way messages show it: control characters (also those of a terminal, and line ends),
/// marks that turn the direction of writing, and bytes that are no UTF-8 become "\xNN", byte by byte.
std::string shown(std::string_view text);
std::string shown(const std::filesystem::path& path);
/// "FILE", or of a frame, from 0, "FILE, frame 17", counted from 1.
std::string shown(const std::filesystem::path& file, std::optional<int> frame);
inline std::string shown(const char* text) { return shown(std::string_view(text)); }
inline std::string shown(const std::string& text) { return shown(std::string_view(text)); }

/// Text of several lines the way messages show it: as `shown`, but line feeds stay.
std::string shown_lines(std::string_view text);

/// The text as one word of a command line, to be pasted into a shell: in single quotes, or where it holds what messages
/// would not show as it is (see `shown`), in those of bash, ksh and zsh, $'a\nb'. Always one line.
std::string shell_quoted(const std::string& text);

}  // namespace tetwarp
