// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Fields in volume files with three components a voxel (image_file.h): MHA and NRRD, as ITK,
// plastimatch and Slicer write them; and what the NIfTI adapter shares with them.
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "io/fields/field_format.h"
#include "io/images/image_reader.h"

namespace tetwarp {

inline constexpr const char* kDirectionKey = "tetwarp_direction";

extern const FieldFormat kFieldFormat_image;

/// @throws InputError unless it has three floats or doubles a voxel
std::unique_ptr<ImageReader> open_vectors(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform);

/// The direction by `kDirectionKey` and what follows from it: Tetwarp writes the key only to LPS mm displacements.
/// @throws InputError for a direction that is neither
void read_stated_direction(const ImageHeader& image, const std::string& file, FieldFileHeader& header);

/// One vector a voxel, as it is.
std::vector<glm::dvec3> read_double_vectors(const ImageReader& reader);

/// Fills one vector a voxel. @param to_mm  from the vector in the file and its vertex number; empty: as it is
void read_vectors(const ImageReader& reader, std::span<glm::vec3> vectors,
                  const std::function<glm::dvec3(const glm::dvec3&, std::size_t)>& to_mm = {});

}  // namespace tetwarp
