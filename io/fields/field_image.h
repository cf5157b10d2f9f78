// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads fields in volume files with three components a voxel (image_file.h): MHA and NRRD, as ITK,
// plastimatch and Slicer write them. The NIfTI adapter shares its functions.
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "io/fields/field_format.h"
#include "io/images/image_reader.h"

namespace tetwarp {

inline constexpr const char* kDirectionKey = "tetwarp_direction";
/// Key with which 3D Slicer says the direction of a field in NRRD (Slicer/Slicer#8757): `resampling`, output to input,
/// or `modeling`, which moves points.
inline constexpr const char* kSlicerDirectionKey = "displacement field type";
inline constexpr const char *kSlicerPull = "resampling", *kSlicerForward = "modeling";

extern const FieldFormat kFieldFormat_image;

/// Opens a volume file. @throws InputError unless it has three floats or doubles a voxel
std::unique_ptr<ImageReader> open_vectors(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform,
                                          NiftiVectors vectors = NiftiVectors::stated);

/// Takes the direction of the field (forward or pull) from the key `kDirectionKey`, where the file has it, and frame
/// and units with it: Tetwarp writes the key only to displacements in LPS mm. Else the direction alone is taken from
/// `kSlicerDirectionKey`.
/// @throws InputError for a direction that is neither, or where both keys contradict each other
void read_stated_direction(const ImageHeader& image, const std::string& file, FieldFileHeader& header);

/// Reads one vector a voxel, unchanged.
std::vector<glm::dvec3> read_double_vectors(const ImageReader& reader);

/// Reads one vector a voxel. @param to_mm  maps a vector of the file and its vertex number to what is stored; empty:
/// vectors are stored unchanged
void read_vectors(const ImageReader& reader, std::span<glm::vec3> vectors,
                  const std::function<glm::dvec3(const glm::dvec3&, std::size_t)>& to_mm = {});

}  // namespace tetwarp
