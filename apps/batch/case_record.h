// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/batch/manifest.h"
#include "apps/deform/deform_outputs.h"
#include "apps/deform/deform_report.h"

namespace tetwarp::apps {

/// What decides a case, a digest each: "program", its "row" wherever manifest and OUTPUT_DIR lie, the bytes of its
/// "input" and of all the others that it reads, "further". Of a de-identified case the key goes in too, so that nobody
/// without it can find the source by trying.
/// @param input_sha256  of INPUT, as sidecars give it
/// @param others  Reads::digests of what is read other than INPUT
nlohmann::json case_identity(const BatchCase& of, const std::string& input_sha256,
                             const std::vector<std::string>& others);

/// A line of results.jsonl for a case that is written but has no name yet: what it was made of, and what came out. The
/// folder's record, kFolderRecord, is written beside the outputs. No clock.
/// @param others  as of case_identity, found before anything was read: what changes meanwhile makes another case
Record record_case(const BatchCase& of, const DeformOutputs& outputs, const DeformRun& run,
                   const DeformWritten& written, const std::vector<std::string>& others);

/// A line for a case that came to nothing. @param status  failed or refused
/// @param kind  what a de-identified case says instead of the reason
Record failed_line(const BatchCase& of, const std::string& status, FixedReason kind, const std::string& reason);

/// Whether the records of a case may not name what it reads.
bool hides(const BatchCase& of);

/// The line of a case that was finished earlier, with paths as they are now: its record is of this case, and every file
/// of it has the bytes that the record says. Otherwise none, and `why` says so, "the row has changed": in words that
/// are the same for all such cases, and none where there is no record.
std::optional<nlohmann::json> finished_line(const BatchCase& of, const std::filesystem::path& folder, std::string& why);

}  // namespace tetwarp::apps
