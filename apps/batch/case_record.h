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

/// What determines the outputs of a case, one digest each: "program", its "row" (the same wherever manifest and
/// OUTPUT_DIR lie), the bytes of its "input" and of all the others that it reads, "further". For a de-identified case
/// the key is hashed, too, so that nobody without it can find the source by trying.
/// @param input_sha256  of INPUT, as sidecars give it
/// @param others        what Reads::digests returns for what is read other than INPUT
nlohmann::json case_identity(const BatchCase& of, const std::string& input_sha256,
                             const std::vector<std::string>& others);

/// A line of results.jsonl for a case that is written but does not have its name yet: what it was made of, and what
/// came out. It also writes the folder's record, kFolderRecord, beside the outputs. Neither holds a time.
/// @param others  the argument of case_identity. It was found before anything was read: a file that changes meanwhile
/// makes it another case
Record record_case(const BatchCase& of, const DeformOutputs& outputs, const DeformRun& run,
                   const DeformWritten& written, const std::vector<std::string>& others);

/// A line of results.jsonl for a case that gave no output.
/// @param status  failed or refused
/// @param kind    stands in for the reason if the case is de-identified
Record failed_line(const BatchCase& of, const std::string& status, FixedReason kind, const std::string& reason);

/// Whether the records of a case may not name the files that it reads.
bool hides(const BatchCase& of);

/// The line of a case that an earlier run finished, with paths as they are now. There is one if the folder's record
/// belongs to this case and every file has the bytes that the record states.
/// @param why  set where there is no line: "the row has changed", in words that are the same for all such cases; empty
/// if there is no record
std::optional<nlohmann::json> finished_line(const BatchCase& of, const std::filesystem::path& folder, std::string& why);

}  // namespace tetwarp::apps
