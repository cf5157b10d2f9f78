// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/cli/options.h"
#include "apps/deform/map_stream.h"

namespace tetwarp::apps {

/// @throws UsageError unless the path is empty or has the suffix of a volume file
void require_image_suffix(const std::filesystem::path& path, const char* option);

/// Whether the name of an inverse means a DICOM Deformable Spatial Registration: .dcm.
bool has_registration_suffix(const std::filesystem::path& path);

/// The maps that options ask for, and where they go while they are made.
class MapOutputs {
 public:
  /// Begins them. @param series  whether OUTPUT is a DICOM series: the inverse may then be a registration object
  /// @throws UsageError for a suffix that is not one of a volume file, and for a map that a pull field
  /// does not have; and what OutputSet::add throws
  MapOutputs(const MapOptions& options, Direction direction, bool series, OutputSet& outputs);

  /// @param grid  of the output. @throws InputError where a map cannot be written on it
  void check(const Geometry& grid) const;

  /// Memory of the maps while they are made.
  /// @param mass  whether mass is preserved, which needs coverage and determinants in any case
  std::uint64_t bytes(const Geometry& grid, bool mass) const;
  /// Begins their files. @param series  OUTPUT, if it is a DICOM series. @throws Error where one cannot be written
  void add_to(MapStream& stream, const Geometry& grid, bool mass, const DerivedSeriesWriter* series) const;
  /// Names of the files, by option.
  nlohmann::json describe() const;

 private:
  MapOptions options_, staged_;
};

}  // namespace tetwarp::apps
