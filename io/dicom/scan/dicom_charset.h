// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tetwarp {

/// Text in the character sets that Specific Character Set (0008,0005) names, with code extensions (PS3.5 6.1.2.5), as
/// messages show it: UTF-8 without control characters. Text that is not what it says it is is taken for UTF-8; bytes
/// that are not that become "\xNN".
std::string shown_text(std::string_view bytes, const std::string& character_set);

/// Text in the character sets that Specific Character Set (0008,0005) names as UTF-8, control characters included;
/// nothing where the bytes do not fit these sets.
std::optional<std::string> decoded_text(std::string_view bytes, const std::string& character_set);

/// UTF-8 in the first of the character sets that Specific Character Set names; none where that has no such characters.
std::optional<std::string> coded_text(const std::string& utf8, const std::string& character_set);

/// Characters of a text in UTF-8.
std::size_t length_of(std::string_view utf8);

}  // namespace tetwarp
