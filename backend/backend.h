// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// What work runs on.
enum class BackendKind : std::uint8_t {
  cpu,  ///< threads and vectors of the processor
  cuda  ///< a CUDA device
};

/// What is wished to run on. Which backend comes of it, `chosen` says.
enum class BackendChoice : std::uint8_t {
  automatic,  ///< a device where one works, else the CPU; the bits are the same, but for mass-spring
  cpu,        ///< the CPU
  cuda        ///< a CUDA device; where none works, what is made there throws
};

/// The choice that a word of the command line, a manifest or a setter of ITK names: "auto", "cpu" or "cuda".
/// @throws InputError for any other word
BackendChoice backend_choice(std::string_view word);
/// The word that `backend_choice` takes for this.
const char* name_of(BackendChoice choice);
/// The word for a backend in reports and messages, "cpu" or "cuda".
const char* name_of(BackendKind kind);
/// All words that `backend_choice` takes, as help shows them.
std::vector<std::string> backend_words();

/// The backend that a choice means on this machine, now. It does not throw: `cuda` stays CUDA where no device works,
/// and what is then made for it throws.
BackendKind chosen(BackendChoice choice);
/// Whether a backend works on a device, which has memory of its own and may fail.
bool runs_on_device(BackendKind kind);

/// Whether a choice leaves it to the machine what work runs on: then the CPU may take over from a device that fails.
bool leaves_open(BackendChoice choice);
/// Whether a device may come of a choice.
bool may_use_device(BackendChoice choice);
/// Whether nothing but a device can come of a choice.
bool demands_device(BackendChoice choice);

/// For each backend one line: its name, and whether this machine can use it.
std::vector<std::string> describe_backends();

}  // namespace tetwarp
