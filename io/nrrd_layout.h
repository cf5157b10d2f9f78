#pragma once

// Private to io/: how the voxels of an NRRD file lie in it.
#include <filesystem>
#include <optional>

#include "io/text_header.h"
#include "io/value_reader.h"

namespace tetwarp {

/// Of an attached NRRD whose data are raw or gzip; none for text, hexadecimal digits and bzip2.
/// @param offset  receives where the data begin, "line skip" and "byte skip" counted
/// @throws InputError for fields that contradict each other or the file
std::optional<ValueLayout> nrrd_layout(const std::filesystem::path& path, const TextHeader& text,
                                       const ImageHeader& header, std::uint64_t& offset);

}  // namespace tetwarp
