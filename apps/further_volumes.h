#pragma once

#include <deque>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/input.h"
#include "apps/options.h"
#include "apps/output.h"

namespace tetwarp::apps {

/// One --with: IN=OUT, and what follows OUT.
struct FurtherOptions {
  InputOptions input;
  std::filesystem::path output;
  std::optional<Interpolation> interpolation;  ///< none: that of INPUT
  std::optional<double> background;            ///< none: as for INPUT
  bool own = false;                            ///< onto its own grid instead of the output's
};

/// @throws UsageError for a text that is not IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]
FurtherOptions parse_further(const std::string& text);

/// Volumes that go through the same field as INPUT: labels, doses, other modalities.
class FurtherVolumes {
 public:
  /// Begins their outputs. @throws UsageError, and what OutputSet::add throws
  FurtherVolumes(const std::vector<std::string>& texts, OutputSet& outputs);

  /// All inputs, for OutputSet.
  static std::vector<std::filesystem::path> inputs(const std::vector<std::string>& texts);
  /// From their headers: with their outputs, where those have `output_voxels`.
  std::uint64_t bytes(std::uint64_t output_voxels);
  void read(const CommonOptions& common, const Control& control);

  /// Grids of their own that volumes go back onto, each once.
  std::vector<Geometry> own_grids() const;
  /// What goes onto a grid: those that asked for their own, or the others. The targets refer to this object.
  std::vector<Target> targets_on(const Geometry& grid, bool own, Interpolation otherwise);
  void write(const std::optional<int>& compression, const std::string& descrip) const;
  nlohmann::json describe() const;

 private:
  struct One {
    FurtherOptions options;
    std::filesystem::path staged;
    InputHeader header;
    InputVolume input;
    AnyVolume output;
    std::string sha256;
    Target target;
  };
  std::deque<One> volumes_;
};

}  // namespace tetwarp::apps
