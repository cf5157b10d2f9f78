// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "apps/cli/options.h"
#include "apps/deform/map_stream.h"
#include "io/dicom_series.h"

namespace tetwarp::apps {

/// Refuses a map that could not be written. @param option  that names the path, for the message
/// @throws UsageError unless the path is empty or has the suffix of a volume file
void require_image_suffix(const std::filesystem::path& path, const char* option);

/// Whether the name of an inverse means a DICOM Deformable Spatial Registration: .dcm.
bool has_registration_suffix(const std::filesystem::path& path);

/// One of the maps of `Maps` (deform/resampler.h): coverage, Jacobian, number of owners, or inverse.
using MapPlace = VolumeView Maps::*;

/// A map that a run makes.
struct WantedMap {
  MapPlace place;
  std::filesystem::path file;  ///< that it is written to; empty: the run itself uses it
};

/// The maps that a run makes.
/// @param files   those that options name
/// @param needed  those that the run uses itself, whether or not they are written
std::vector<WantedMap> wanted_maps(const MapOptions& files, std::span<const MapPlace> needed);

/// @param pulls   whether the field is a pull field, which has no tetrahedra
/// @param series  whether OUTPUT is a DICOM series: the inverse may then be a registration object
/// @throws UsageError for a suffix that is not one of a volume file, and for a map that a pull field does not have
void check_maps(const MapOptions& files, bool pulls, bool series);

/// Bytes of the maps while they are made. @param grid  of the output
std::uint64_t map_bytes(const std::vector<WantedMap>& maps, const Geometry& grid);
/// Begins their files. @param series  OUTPUT, if it is a DICOM series. @throws Error where one cannot be written
void add_maps(const std::vector<WantedMap>& maps, const Geometry& grid, const DerivedSeriesWriter* series,
              MapStream& stream);
/// Names of the files that were asked for, by the name of their option, for the sidecar.
nlohmann::json maps_json(const MapOptions& files);

}  // namespace tetwarp::apps
