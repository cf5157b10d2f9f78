// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: words and numbers of the text headers of MHA and NRRD.
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// The text without the blanks at its ends.
std::string trimmed(const std::string& text);

/// The parts of a text that blanks and tabulators separate.
std::vector<std::string> words(const std::string& text);

/// The number that a word is, "nan" and "inf" among them; nothing where the word is anything else, or more.
/// Locales do not count.
std::optional<double> to_number(std::string_view word);

/// The whole number from 0 on that a word is, "3.0" too; nothing for another word.
std::optional<std::int64_t> to_whole_number(std::string_view word);

/// Three numbers, each with as many digits as bring the same double back.
std::string exact(const glm::dvec3& v, const char* separator);

/// A direction cosine as files in text are read: -0 is 0, and what rounding left within 1e-15 of 1 or -1 is that.
double snapped_cosine(double cosine);

}  // namespace tetwarp
