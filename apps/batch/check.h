// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "apps/batch/manifest.h"
#include "apps/deform/deform_plan.h"

namespace tetwarp::apps {

/// What is known of a batch before it runs.
struct BatchCheck {
  std::map<std::string, DiskBytes> disk;  ///< of the outputs of each case, by its id; nothing of one that will fail
  std::vector<std::string> forecasts;     ///< cases that will fail, "ID: reason"
};

/// Opens the headers of every case and plans it, in parallel. Nothing is written.
/// @param folder  OUTPUT_DIR, in which nothing may lie that is read
/// @throws InputError with a line for each row that `deform` would refuse; Cancelled
BatchCheck check_cases(const std::filesystem::path& manifest, const std::filesystem::path& folder,
                       const std::vector<const BatchCase*>& cases, std::uint64_t memory_bytes, const Control& control);

/// What the outputs of some of the cases take that were checked.
DiskBytes disk_of(const BatchCheck& check, const std::vector<const BatchCase*>& cases);

/// Compares outputs that are to be written with the free space.
/// @throws Error where the outputs that are not compressed do not fit
/// @return a warning where the others might not fit; else empty
std::string check_space(const DiskBytes& disk, const std::filesystem::path& folder);

}  // namespace tetwarp::apps
