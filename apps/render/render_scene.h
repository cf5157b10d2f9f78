// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/input.h"
#include "apps/cli/options.h"
#include "apps/deform/field_source.h"
#include "io/overlay.h"
#include "io/slice_picture.h"

namespace tetwarp::apps {

/// An overlay from the command line: "jacobian", "jacobian=FILE" or "lattice=FIELD".
struct OverlayWish {
  OverlayKind kind = OverlayKind::coverage;
  std::string source;  ///< file or field that gives the overlay; empty: the field that deforms the volume
};
/// Parses the argument of --overlay. @throws UsageError
OverlayWish overlay_wish(const std::string& text);

/// Whether the argument of --transfer is the name of a file.
bool is_transfer_file(const RenderOptions& options);

/// An overlay, and the memory that holds its map.
struct OwnedOverlay {
  Overlay overlay;
  std::shared_ptr<const AnyVolume> map;
};

/// The volume that `render` shows, frame by frame as it is deformed: by a field that grows from frame to frame, or by
/// one field after the other.
class RenderScene {
 public:
  /// Opens all inputs that the options name.
  /// @throws InputError and whatever else `open_input` throws
  explicit RenderScene(const RenderOptions& options);
  ~RenderScene();

  void read();
  std::size_t frames() const;
  /// Deforms the volume for a frame.
  void show(std::size_t frame);

  const InputHeader& header() const { return header_; }
  const Geometry& grid() const { return grid_; }
  ConstVolumeView volume() const;  ///< the volume of the frame that is shown
  const VertexField* lattice_field()
      /// The lattice field that moves the volume in this frame; null: there is none.
      const;
  const std::vector<OverlayWish>& wishes() const { return wishes_; }
  /// An overlay for a part of the volume. @param wish  one of `wishes()`
  OwnedOverlay overlay(const OverlayWish& wish, const Region& region);
  /// What deforms the volume, for the title: "wave:amplitude=8, then twist.mha", without folders; empty: nothing does.
  std::string field_title(std::size_t frame) const;
  const std::string& backend() const { return backend_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void read_fields(const Control& control);
  void set_frame_field(double amount, const Control& control);
  OwnedOverlay computed(OverlayKind kind, const Region& region);
  OwnedOverlay from_file(const OverlayWish& wish, const Region& region);

  const RenderOptions& options_;
  InputOptions input_options_;  ///< with the hash off, for it is not used
  std::vector<OverlayWish> wishes_;
  InputHeader header_;
  InputVolume input_;
  Geometry grid_;
  bool deforms_ = false;
  AnyField field_;           ///< the field at its full amount
  VertexField frame_field_;  ///< the field of a frame in which it has not grown to its full amount
  PullField frame_pull_;
  const VertexField* shown_field_ = nullptr;  ///< the field of the frame: `frame_field_`, or `field_`
  VertexField drawn_lattice_;                 ///< the lattice of the overlay `lattice=FIELD`
  AnyVolume output_;
  std::unique_ptr<Resampler> resampler_, lattice_resampler_;
  std::vector<std::shared_ptr<const AnyVolume>> files_;  ///< by overlay: the volume of its file; null where it has none
  std::string backend_;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::apps
