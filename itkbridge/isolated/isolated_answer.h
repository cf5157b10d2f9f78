// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: what tetwarp-read writes over its descriptor 3 to the process that started it. Both run on one
// machine.
//
//   kReadGreeting, then one Answer:
//     records    how many, and of each its name, its head, its values
//     refusal    the words
//     no_memory  nothing more
//
// Numbers are std::uint64_t; of a text or a list, first its length is written, then its elements.
#include <string_view>

namespace tetwarp {

/// The first bytes of an answer. The number changes with the format of answers, and with the arguments of the program:
/// KIND FILE PART MEMORY_BYTES CPU_SECONDS SECONDS PARENT.
inline constexpr std::string_view kReadGreeting = "tetwarp-read 2\n";
inline constexpr int kReadArguments = 7;
inline constexpr int kAnswerDescriptor = 3;

enum class Answer : char { records, refusal, no_memory };

}  // namespace tetwarp
