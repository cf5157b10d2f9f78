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
#include "backend/factories.h"
#include "io/overlay.h"
#include "io/slice_picture.h"

namespace tetwarp::apps {

/// An overlay from the command line: "jacobian", "jacobian=FILE" or "lattice=FIELD".
struct OverlayWish {
  OverlayKind kind = OverlayKind::coverage;
  std::string source;  ///< empty: of the field that deforms the volume
};
/// @throws UsageError
OverlayWish overlay_wish(const std::string& text);

/// Whether --transfer is the name of a file.
bool is_transfer_file(const RenderOptions& options);

/// An overlay with the memory of its map.
struct OwnedOverlay {
  Overlay overlay;
  std::shared_ptr<const AnyVolume> map;
};

/// The volume that `render` shows, frame by frame as it is deformed: by a field that grows, or by one field after the
/// other.
class RenderScene {
 public:
  /// Opens all inputs that the options name.
  /// @throws InputError and others, as `open_input`
  explicit RenderScene(const RenderOptions& options);
  ~RenderScene();

  void read();
  std::size_t frames() const;
  /// Deforms the volume as it is in a frame.
  void show(std::size_t frame);

  const InputHeader& header() const { return header_; }
  const Geometry& grid() const { return grid_; }
  ConstVolumeView volume() const;  ///< of the frame that is shown
  const VertexField* lattice_field()
      const;  ///< that moves the volume in this frame; null: there is none with a lattice
  const std::vector<OverlayWish>& wishes() const { return wishes_; }
  /// What lies over a part of the volume. @param wish  one of `wishes()`
  OwnedOverlay overlay(const OverlayWish& wish, const Region& region);
  /// "wave:amplitude=8, then twist.mha", without folders; empty: nothing deforms.
  std::string field_title(std::size_t frame) const;
  const std::string& backend() const { return backend_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void read_fields(const Control& control);
  void set_frame_field(double amount, const Control& control);
  OwnedOverlay computed(OverlayKind kind, const Region& region);
  OwnedOverlay from_file(const OverlayWish& wish, const Region& region);

  const RenderOptions& options_;
  InputOptions input_options_;  ///< without the hash, which is not used
  std::vector<OverlayWish> wishes_;
  InputHeader header_;
  InputVolume input_;
  Geometry grid_;
  bool deforms_ = false;
  AnyField field_;           ///< whole
  VertexField frame_field_;  ///< of a frame in which it has not grown to its whole
  PullField frame_pull_;
  const VertexField* shown_field_ = nullptr;  ///< of the frame: that one, or the whole
  VertexField drawn_lattice_;                 ///< of `lattice=FIELD`
  AnyVolume output_;
  AnyResampler resampler_;
  std::unique_ptr<ForwardResampler> lattice_resampler_;
  std::vector<std::shared_ptr<const AnyVolume>> files_;  ///< of the wishes; null where there is none
  std::string backend_;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::apps
