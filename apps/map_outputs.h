#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/backend.h"
#include "apps/options.h"
#include "apps/output.h"
#include "deform/vertex_field.h"

namespace tetwarp::apps {

/// @throws UsageError unless the path is empty or has the suffix of a volume file
void require_image_suffix(const std::filesystem::path& path, const char* option);

/// The maps that options ask for: where they go while they are made, and their voxels.
class MapOutputs {
 public:
  /// Begins them. @throws UsageError for a suffix that is not one of a volume file, and for a map that a pull field
  /// does not have; and what OutputSet::add throws
  MapOutputs(const MapOptions& options, Direction direction, OutputSet& outputs);

  std::uint64_t bytes_a_voxel() const;
  /// Makes them on a grid. They refer to this object. @param jacobian  whether that is needed, whatever is asked for
  Maps make(const Geometry& grid, bool jacobian);
  void write() const;
  /// Names of the files, by option.
  nlohmann::json describe() const;

 private:
  MapOptions options_, staged_;
  AnyVolume coverage_, jacobian_, owners_;
  PullField inverse_;
};

}  // namespace tetwarp::apps
