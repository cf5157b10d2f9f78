#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/batch/manifest.h"
#include "apps/deformation.h"

namespace tetwarp::apps {

/// What decides a case, as a digest: program version, arguments and the bytes of all that it reads. Of a de-identified
/// case the key goes in too, so that nobody without it can find the source by trying.
/// @param input_sha256  of INPUT, as sidecars give it
std::string case_identity(const BatchCase& of, const std::string& input_sha256);

/// SHA-256 of INPUT as sidecars give it, without reading voxels. @throws InputError
std::string hash_input(const DeformOptions& options);

/// A line of results.jsonl for a case that is written but has no name yet: what it was made of, and what came out. The
/// folder's record, kFolderRecord, is written beside the outputs. No clock.
nlohmann::json record_case(const BatchCase& of, const Deformation& made);

/// A line for a case that came to nothing. @param status  failed or refused
nlohmann::json failed_line(const BatchCase& of, const std::string& status, const std::string& reason);

/// The line of a case that was finished earlier: its record is of this case, and every file of it has the bytes that
/// the record says. Otherwise none, and `why` says so.
std::optional<nlohmann::json> finished_line(const BatchCase& of, const std::filesystem::path& folder, std::string& why);

}  // namespace tetwarp::apps
