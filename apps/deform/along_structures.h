// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <deque>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "apps/cli/options.h"
#include "apps/cli/output.h"
#include "deform/contours/contour_mover.h"
#include "deform/contours/reslicer.h"
#include "io/dicom_structures.h"

namespace tetwarp::apps {

/// The `--with STRUCTURES.dcm=OUT.dcm` of one command: RT Structure Sets that were drawn on INPUT, and go with it.
class AlongStructures {
 public:
  /// Whether the text of a `--with` names a structure set. Looks into the file.
  static bool is_one(const std::string& text);

  AlongStructures() = default;
  /// Begins their outputs. @param series  whether OUTPUT is one
  /// @throws UsageError for a text that is not IN.dcm=OUT.dcm, or without a series; and what OutputSet::add throws
  AlongStructures(const std::vector<std::string>& texts, bool series, OutputSet& outputs);

  bool empty() const { return sets_.empty(); }
  /// Reads all files. @throws InputError for one that was not drawn in the frame of reference of the series
  void read(const std::string& frame_of_reference_uid);

  /// Moves what can be moved as points. @param mover  null: the field has no forward map
  void move(const PointMover* mover, const Geometry& source, const Geometry& output, Outside outside, int threads);
  /// Whether some structures have to be drawn anew, which needs the inverse of the field.
  bool needs_inverse() const;
  /// Draws them on the slices that the inverse map has. Slabs of slices follow one another.
  void reslice(const ConstVolumeView& inverse_mm, int threads);
  /// After the last slice: takes what was drawn.
  void finish();

  void write(const DicomWriteReport& series, const DicomDerivation& derivation);
  /// "structures" of sidecar and report.
  nlohmann::json describe() const;
  /// For people: what could not be moved, or not wholly.
  std::vector<std::string> notes() const;

 private:
  enum class How : std::uint8_t { none, points, resliced };
  /// Contours in slices of the output, so far.
  struct Drawn {
    std::vector<Contour> contours;
    double volume = 0;  ///< mm3
    bool cut = false;
  };
  struct Roi {
    How how = How::none;
    std::optional<Reslicer> reslicer;
    std::array<Drawn, 2> drawn;  ///< anew, for each kind of Between
    Between between = Between::interpolated;
    std::vector<Contour> moved;
    double volume_before = 0, volume_after = 0;  ///< mm3
    std::size_t parts = 0;                       ///< runs of planes
    std::size_t left_out = 0;                    ///< contours whose way is not known
    std::size_t beyond = 0;  ///< contours that come to lie, wholly or in part, where the output has no voxels
    bool cut = false, at_end = false;
    std::string problem;  ///< why nothing is known of it
  };
  struct Set {
    std::filesystem::path input, output, staged;
    std::string sha256;
    StructureSet structures;
    std::vector<Roi> rois;
    StructureWriteReport written;
  };

  static void move(Roi& roi, const Structure& structure, const PointMover* mover, const Geometry& source,
                   const Geometry& output, Outside outside);
  /// Takes closed contours that stay in slices. @return whether they do
  static bool take_moved(Roi& roi, const ContourMover& mover, std::span<const Contour> contours, const Geometry& source,
                         const Geometry& output, Outside outside);

  std::deque<Set> sets_;
  bool forward_ = true;
  std::int64_t last_slice_ = 0;
};

}  // namespace tetwarp::apps
