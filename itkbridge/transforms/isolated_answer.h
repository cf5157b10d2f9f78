// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: what tetwarp-read says to whom started it, over its descriptor 3. Both run on one machine.
//
//   kReadGreeting, then one Answer:
//     records    how many, and of each its type, its fixed parameters, its parameters
//     refusal    the words
//     no_memory  nothing more
//
// Numbers are std::uint64_t; texts and lists are how many there are, and then they.
#include <string_view>

namespace tetwarp {

/// Changes with what follows it, and with the arguments: KIND FILE MEMORY_BYTES CPU_SECONDS SECONDS PARENT.
inline constexpr std::string_view kReadGreeting = "tetwarp-read 1\n";
inline constexpr int kReadArguments = 6;
inline constexpr int kAnswerDescriptor = 3;

enum class Answer : char { records, refusal, no_memory };

}  // namespace tetwarp
