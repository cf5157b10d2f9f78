// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "apps/batch/manifest.h"

namespace tetwarp::apps {

/// What is known of a batch before it runs.
struct BatchCheck {
  std::uint64_t plain_bytes = 0;       ///< that the outputs take on disk: those that are not compressed
  std::uint64_t packed_bytes = 0;      ///< those that are, before that
  std::vector<std::string> forecasts;  ///< cases that will fail, "ID: reason"
};

/// Opens the headers of every case and plans it, in parallel: nothing is written.
/// @param folder  OUTPUT_DIR, which must be clear of all that is read
/// @throws InputError for rows that `deform` would refuse, all of them, one a line; Cancelled
BatchCheck check_cases(const std::filesystem::path& manifest, const std::filesystem::path& folder,
                       const std::vector<const BatchCase*>& cases, std::uint64_t memory_bytes, const Control& control);

/// @throws Error where the outputs that are not compressed do not fit
/// @return what to say where all might not fit; else empty
std::string check_space(const BatchCheck& check, const std::filesystem::path& folder);

}  // namespace tetwarp::apps
