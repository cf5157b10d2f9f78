// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tetwarp {

/// Decodes text in the character sets that Specific Character Set (0008,0005) names, with code extensions (PS3.5
/// 6.1.2.5), for messages: UTF-8 without control characters. Text that does not fit its character sets is taken for
/// UTF-8; bytes that are not UTF-8 become "\xNN".
std::string shown_text(std::string_view bytes, const std::string& character_set);

/// Decodes text in the character sets that Specific Character Set (0008,0005) names to UTF-8, control characters
/// included; none where the bytes do not fit these sets.
std::optional<std::string> decoded_text(std::string_view bytes, const std::string& character_set);

/// Encodes UTF-8 in the first of the character sets that Specific Character Set names; none where that set lacks one of
/// the characters.
std::optional<std::string> coded_text(const std::string& utf8, const std::string& character_set);

/// How many characters a text in UTF-8 has.
std::size_t length_of(std::string_view utf8);

}  // namespace tetwarp
