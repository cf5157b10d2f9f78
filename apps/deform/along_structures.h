// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/deform/along_choice.h"
#include "deform/contours/contour_mover.h"
#include "deform/contours/reslicer.h"
#include "io/dicom_structures.h"

namespace tetwarp::apps {

// RT Structure Sets that were drawn on INPUT, and go along with it through the field. Each stage of a run has a value
// for each of them, in the order of the options.

struct StructuresInput {
  AlongStructuresChoice choice;
  std::string sha256;
  StructureSet structures;
};

/// A structure as it came out of the field.
struct MovedRoi {
  enum class How : std::uint8_t { none, points, resliced };

  How how = How::none;
  Between between = Between::interpolated;
  std::vector<Contour> contours;               ///< in slices of the output
  double volume_before = 0, volume_after = 0;  ///< mm3
  std::size_t parts = 0;                       ///< runs of planes
  std::size_t left_out = 0;                    ///< contours whose way is not known
  std::size_t beyond = 0;  ///< contours that come to lie, wholly or in part, where the output has no voxels
  bool cut = false, at_end = false;
  std::string problem;  ///< why nothing is known of it
};
/// Those of a structure set, in its order.
using MovedStructures = std::vector<MovedRoi>;

/// Reads all files. @throws InputError for one that was not drawn in the frame of reference of the series
std::vector<StructuresInput> read_structures(const std::vector<AlongStructuresChoice>& choices,
                                             const std::string& frame_of_reference_uid);

/// Moves structures: as points where that will do, else they are drawn anew from the inverse of the field, which comes
/// slab by slab.
class StructureMover {
 public:
  /// Moves what can be moved as points. @param sets  must outlive this object
  /// @param mover  null: the field has no forward map
  /// @param source, output  grids of INPUT and OUTPUT
  StructureMover(const std::vector<StructuresInput>& sets, const PointMover* mover, const Geometry& source,
                 const Geometry& output, Outside outside, int threads);

  /// Whether some structures have to be drawn anew.
  bool needs_inverse() const;
  /// Draws them on the slices that the inverse map has. Slabs of slices follow one another.
  void reslice(const ConstVolumeView& inverse_mm);
  /// After the last slice: what came of each set.
  std::vector<MovedStructures> finish() &&;

 private:
  /// Contours in slices of the output, so far.
  struct Drawn {
    std::vector<Contour> contours;
    double volume = 0;  ///< mm3
    bool cut = false;
  };
  struct Roi {
    MovedRoi moved;
    std::optional<Reslicer> reslicer;
    std::array<Drawn, 2> drawn;  ///< anew, for each kind of Between
  };

  void move(Roi& roi, const Structure& structure, const PointMover* mover, const Geometry& source) const;
  void finish(Roi& roi) const;

  std::vector<std::vector<Roi>> sets_;
  bool forward_;
  Geometry output_;
  Outside outside_;
  int threads_;
};

/// @param staged  where each is written
/// @param series  OUTPUT, as it was written
std::vector<StructureWriteReport> write_structures(const std::vector<std::filesystem::path>& staged,
                                                   const std::vector<StructuresInput>& sets,
                                                   const std::vector<MovedStructures>& moved,
                                                   const DicomWriteReport& series, const DicomDerivation& derivation);

/// "structures" of sidecar and report.
nlohmann::json structures_json(const std::vector<StructuresInput>& sets, const std::vector<MovedStructures>& moved,
                               const std::vector<StructureWriteReport>& written);
/// For people: what could not be moved, or not wholly.
std::vector<std::string> notes_of(const std::vector<StructuresInput>& sets, const std::vector<MovedStructures>& moved);

}  // namespace tetwarp::apps
