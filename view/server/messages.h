// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "view/session/stage.h"

namespace tetwarp::viewer {

/// The first message of a page.
struct Hello {
  std::string token;   ///< that the address had
  bool takes = false;  ///< whether the page that looks now is to be let go of
};

/// Most bytes of a message from a page: a cut along a long line has a few thousand numbers.
constexpr std::size_t kMostMessageBytes = 64 * 1024;

/// Reads a message of the page: a JSON object with "do", and the keys of what is to be done
/// (docs/design/viewer.md).
/// @throws InputError for anything else; the message says what is wrong, and repeats nothing of the text but keys
std::variant<Hello, Request> read_message(std::string_view text);

/// What a page is told first: all that does not change.
struct About {
  std::string title;                         ///< no name of a patient
  Geometry grid;                             ///< of the deformed volume
  std::string backend;                       ///< where the work is done
  bool hounsfield = false;                   ///< whether values are HU
  std::vector<std::string> styles;           ///< names of transfer functions
  std::vector<std::string> volume_suffixes;  ///< what the deformed volume may be saved as
  std::vector<std::string> film_suffixes;    ///< and films
  std::string folder;                        ///< where files go
  bool labels = false;                       ///< whether there are any
  int frames = 0;                            ///< of the reel; 0: hands work
  bool grows = false;                        ///< whether the reel is a field that grows
  bool pulls = false;                        ///< whether it is one of pull fields
};

// The messages to a page, as JSON text.

std::string message_of(const About& about);
std::string message_of(const State& state);
std::string message_of(const Answer& answer);
/// That something was saved. @param command  that makes the same again
std::string message_of_saved(std::uint32_t number, const std::vector<std::string>& files, const std::string& command);
/// That something is being saved.
std::string message_of_progress(std::uint32_t number);
/// What a page must say from now on in the place of its token.
std::string message_of_secret(const std::string& secret);
/// Why a page is sent away.
std::string message_of_refusal(const std::string& reason);

/// A picture as a binary message: the number of bytes of a JSON text (32 bits, the lowest byte first), that text, and
/// the bytes of the file.
std::string message_of(const Picture& picture);

}  // namespace tetwarp::viewer
