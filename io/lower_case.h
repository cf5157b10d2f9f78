// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

namespace tetwarp {

/// A text with its ASCII letters small, whatever the locale; other bytes stay. For words of formats and suffixes of
/// files, not for names of people (comparable_text.h).
inline std::string lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

}  // namespace tetwarp
