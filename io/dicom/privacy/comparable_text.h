// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: texts that are the same to a reader although their characters differ.
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// Spellings of a text that can be compared with those of others. A spelling has words of letters and digits in UTF-8
/// with one space between them, after full case folding (Unicode 3.13) and compatibility decomposition (UAX 15),
/// without marks, with digits of any script as ASCII's. "Müller" and "MU\u0308LLER" are "muller".
///
/// A text that is not ASCII has further spellings: in Latin letters of ASCII, by ICU's transliteration ("Иванов":
/// "ivanov"), and with ä, ö, ü, å, ø written out as ae, oe, ue, aa, oe ("mueller"). Two texts that have a spelling in
/// common may be the same.
std::vector<std::string> spellings_of(std::string_view utf8);

/// The text as UTF-8: bytes that are not UTF-8 are taken for Latin-1.
std::string utf8_or_latin1(std::string_view bytes);

}  // namespace tetwarp
