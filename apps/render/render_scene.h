// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/input.h"
#include "apps/cli/options.h"
#include "apps/cli/reads.h"
#include "apps/fields/read_field.h"
#include "io/overlay.h"
#include "io/slice_picture.h"

namespace tetwarp::apps {

/// An overlay from the command line: "jacobian", "jacobian=FILE" or "lattice=FIELD".
struct OverlayWish {
  std::string text;
  OverlayKind kind = OverlayKind::coverage;
  std::filesystem::path map;             ///< file that gives the overlay; empty: a field gives it
  std::optional<ForwardChoice> lattice;  ///< the field of lattice=FIELD

  /// Whether the field that deforms the volume gives the overlay.
  bool is_of_deformation() const { return map.empty() && !lattice; }
};

/// The fields that a picture is made with, parsed.
struct RenderFields {
  std::optional<FieldChoice> deforming;  ///< deforms the volume in all pictures
  std::vector<ForwardChoice> sequence;   ///< instead: each deforms one picture
  std::vector<OverlayWish> overlays;

  bool deform() const { return deforming || !sequence.empty(); }
};
/// @throws UsageError for fields as parse_field does, and for an overlay that is not known
RenderFields parse_render_fields(const RenderOptions& options);
Reads reads_of(const RenderOptions& options, const RenderFields& fields);

/// Whether the argument of --transfer is the name of a file.
bool is_transfer_file(const RenderOptions& options);

/// An overlay, and the memory that holds its map.
struct OwnedOverlay {
  Overlay overlay;
  std::shared_ptr<const AnyVolume> map;
};

/// The volume that `render` shows, frame by frame as it is deformed: by a field that grows from frame to frame, from
/// nothing in the first to its full amount in the last, or by one field after the other. With one frame the field has
/// its full amount. Call `read` once, then for each frame `show`, and what tells of it.
class RenderScene {
 public:
  /// Opens the volume: afterwards `header` and `grid` are known. Keeps references to options and fields, which must
  /// outlive this.
  /// @throws UsageError for an overlay that lacks the field that it is of; and whatever `open_input` throws
  RenderScene(const RenderOptions& options, const RenderFields& fields);
  ~RenderScene();

  /// Reads the volume, the field and the files of overlays. @throws InputError for what cannot be read
  void read();
  /// How many frames there are: 1 without a field that grows and without a sequence.
  std::size_t frames() const;
  /// Deforms the volume for a frame. @param frame  from 0
  void show(std::size_t frame);

  const InputHeader& header() const { return header_; }
  /// The grid that is shown: that of the volume, or a straight and even one around it.
  const Geometry& grid() const { return grid_; }
  ConstVolumeView volume() const;  ///< the volume of the frame that is shown
  /// The lattice field that moves the volume in this frame; null: there is none.
  const VertexField* lattice_field() const;
  const std::vector<OverlayWish>& wishes() const { return fields_.overlays; }
  /// An overlay for a part of the volume. @param wish  one of `wishes()`
  OwnedOverlay overlay(const OverlayWish& wish, const Region& region);
  /// What deforms the volume, for the title: "wave:amplitude=8, then twist.mha", without folders; empty: nothing does.
  std::string field_title(std::size_t frame) const;
  /// What deforms the volume, "cpu" or "cuda"; empty before the first frame, and where nothing is deformed.
  const std::string& backend() const { return backend_; }
  /// Remarks on what was read, for people.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  void read_field(const Control& control);
  void read_overlay(const OverlayWish& wish);
  /// Takes what is to be said of a field, each once.
  void add_notes(const std::vector<std::string>& notes);
  const VertexField* shown_forward_field() const {
    return shown_field_ ? std::get_if<VertexField>(shown_field_) : nullptr;
  }
  void set_frame_field(double amount, const Control& control);
  OwnedOverlay computed(OverlayKind kind, const Region& region);
  OwnedOverlay from_file(const OverlayWish& wish, const Region& region);

  const RenderOptions& options_;
  const RenderFields& fields_;
  InputOptions input_options_;  ///< with the hash off, for it is not used
  InputHeader header_;
  InputVolume input_;
  Geometry grid_;
  bool deforms_ = false;
  AnyField field_;                         ///< the field at its full amount
  AnyField frame_field_;                   ///< the field of a frame in which it has not grown to its full amount
  const AnyField* shown_field_ = nullptr;  ///< the field of the frame: `frame_field_`, or `field_`
  VertexField drawn_lattice_;              ///< the lattice of the overlay `lattice=FIELD`
  AnyVolume output_;
  AnyResampler resampler_;
  std::unique_ptr<ForwardResampler> lattice_resampler_;
  std::vector<std::shared_ptr<const AnyVolume>>
      maps_;  ///< by overlay: the volume of its file or map; null: it has none
  std::string backend_;
  std::vector<std::string> notes_;
};

}  // namespace tetwarp::apps
