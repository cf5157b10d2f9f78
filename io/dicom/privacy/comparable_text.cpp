// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/privacy/comparable_text.h"

#include <unicode/normalizer2.h>
#include <unicode/translit.h>
#include <unicode/uchar.h>
#include <unicode/unistr.h>

#include <algorithm>
#include <memory>
#include <mutex>

#include "deform/errors.h"

namespace tetwarp {
namespace {

void require_icu(UErrorCode status, const char* what) {
  if (U_FAILURE(status)) throw Error(std::string("ICU has no ") + what + " (" + u_errorName(status) + ")");
}

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

/// The text case-folded and decomposed; marks are still characters of their own.
icu::UnicodeString decomposed(const icu::UnicodeString& text) {
  UErrorCode status = U_ZERO_ERROR;
  const icu::Normalizer2* fold = icu::Normalizer2::getNFKCCasefoldInstance(status);
  const icu::Normalizer2* decompose = icu::Normalizer2::getNFKDInstance(status);
  require_icu(status, "normalisation");
  icu::UnicodeString result = decompose->normalize(fold->normalize(text, status), status);
  require_icu(status, "normalisation");
  return result;
}

/// Writes letters with marks that some languages spell with two letters (ä, ö, ü, å, ø) as these.
icu::UnicodeString with_letters_for_marks(const icu::UnicodeString& text) {
  constexpr UChar32 kDiaeresis = 0x308, kRing = 0x30a, kSlashedO = 0xf8;
  icu::UnicodeString result;
  UChar32 before = 0;
  for (std::int32_t i = 0; i < text.length(); i = text.moveIndex32(i, 1)) {
    const UChar32 c = text.char32At(i);
    if (c == kDiaeresis && (before == 'a' || before == 'o' || before == 'u'))
      result.append(static_cast<UChar32>('e'));
    else if (c == kRing && before == 'a')
      result.append(static_cast<UChar32>('a'));
    else if (c == kSlashedO)
      result.append(icu::UnicodeString("oe"));
    else
      result.append(c);
    before = c;
  }
  return result;
}

/// Letters and digits of a text.
/// @param gap  replaces characters that are neither letters nor digits; 0: these are left out
icu::UnicodeString letters_and_digits(const icu::UnicodeString& text, UChar32 gap) {
  icu::UnicodeString result;
  for (std::int32_t i = 0; i < text.length(); i = text.moveIndex32(i, 1)) {
    const UChar32 c = text.char32At(i);
    if ((U_GET_GC_MASK(c) & U_GC_M_MASK) != 0) continue;
    const bool ends_word = result.isEmpty() || result.endsWith(icu::UnicodeString(' '));
    if (u_charType(c) == U_DECIMAL_DIGIT_NUMBER)
      result.append(static_cast<UChar32>('0' + u_charDigitValue(c)));
    else if (u_isalnum(c))
      result.append(c);
    else if ((gap != 0 || c == ' ') && !ends_word)
      result.append(static_cast<UChar32>(' '));
  }
  return result.trim();
}

/// The text in Latin letters of ASCII, where ICU has a transliteration.
icu::UnicodeString latin(icu::UnicodeString text) {
  static std::mutex turn;  // a transliterator has a state, so one thread uses it at a time
  const std::lock_guard lock(turn);
  static const std::unique_ptr<icu::Transliterator> made = [] {
    UErrorCode status = U_ZERO_ERROR;
    std::unique_ptr<icu::Transliterator> any(
        icu::Transliterator::createInstance("Any-Latin; Latin-ASCII", UTRANS_FORWARD, status));
    require_icu(status, "transliteration");
    return any;
  }();
  made->transliterate(text);
  return letters_and_digits(decomposed(text), 0);
}

std::string utf8_of(const icu::UnicodeString& text) {
  std::string utf8;
  return text.toUTF8String(utf8);
}

std::string ascii_words(std::string_view text) {
  std::string words;
  for (const char c : text) {
    const bool upper = c >= 'A' && c <= 'Z', other = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (upper || other)
      words += upper ? static_cast<char>(c - 'A' + 'a') : c;
    else if (!words.empty() && words.back() != ' ')
      words += ' ';
  }
  if (words.ends_with(' ')) words.pop_back();
  return words;
}

/// Bytes of the UTF-8 character with which a text begins; 0: it begins with none. Surrogates and overlong forms count
/// as UTF-8, for ICU replaces them.
std::size_t utf8_length(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xc2 ? 0
                             : lead < 0xe0 ? 2
                             : lead < 0xf0 ? 3
                             : lead < 0xf5 ? 4
                                           : 0;
  if (length > text.size()) return 0;
  const auto follows = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; };
  return std::all_of(text.begin() + 1, text.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(length, 1)),
                     follows)
             ? length
             : 0;
}

}  // namespace

std::vector<std::string> spellings_of(std::string_view utf8) {
  if (is_ascii(utf8)) return {ascii_words(utf8)};
  const icu::UnicodeString text =
      decomposed(icu::UnicodeString::fromUTF8(icu::StringPiece(utf8.data(), static_cast<std::int32_t>(utf8.size()))));
  std::vector<std::string> spellings = {utf8_of(letters_and_digits(text, ' '))};
  for (const icu::UnicodeString& one : {text, with_letters_for_marks(text)}) {
    std::string next = utf8_of(latin(letters_and_digits(one, ' ')));
    if (std::find(spellings.begin(), spellings.end(), next) == spellings.end()) spellings.push_back(std::move(next));
  }
  return spellings;
}

std::string utf8_or_latin1(std::string_view bytes) {
  std::string text;
  while (!bytes.empty()) {
    const std::size_t length = utf8_length(bytes);
    if (length > 0) {
      text += bytes.substr(0, length);
    } else {
      const auto byte = static_cast<unsigned char>(bytes.front());
      text += static_cast<char>(0xc0 | byte >> 6);
      text += static_cast<char>(0x80 | (byte & 0x3f));
    }
    bytes.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return text;
}

}  // namespace tetwarp
