// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tetwarp {

/// A text of the form NAME or NAME:KEY=VALUE,KEY=VALUE. Its parts refer to the text.
struct ParameterText {
  std::string_view name;                                              ///< what stands before the colon
  std::vector<std::pair<std::string_view, std::string_view>> values;  ///< keys, each once, in order
};

/// The parts of a text between separators; one, empty, of an empty text.
std::vector<std::string_view> split(std::string_view text, char separator);

/// The name of a text of parameters: what stands before the first colon.
inline std::string_view name_of(std::string_view text) { return text.substr(0, text.find(':')); }

/// Takes a text of parameters apart.
/// @param about  begins messages, such as "formula \"wave:axis=x\""
/// @throws InputError for a part that is not KEY=VALUE, or a key that is given twice
ParameterText parse_parameters(std::string_view text, const std::string& about);

}  // namespace tetwarp
