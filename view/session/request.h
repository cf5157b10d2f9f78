// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "deform/core/host_device.h"
#include "deform/simulate/scenario.h"
#include "view/session/scene.h"

/// What may be asked of a stage, one type each.
namespace tetwarp::viewer::request {

/// A pane of the page.
enum class Pane : std::uint8_t { axial, coronal, sagittal, volume };
constexpr int kPanes = 4;
/// The plane of a pane of slices.
constexpr AnatomicalPlane plane_of(Pane pane) { return static_cast<AnatomicalPlane>(pane); }

/// A place that somebody points to: of the deformed picture in LPS mm, or of the volume's picture, from 0 at its left
/// and upper edge to 1 at its right and lower one, where the thing is meant that is seen there.
using Pointed = std::variant<glm::dvec3, glm::dvec2>;

/// How large a pane is. @note a size of 0: it is not seen
struct Size {
  Pane pane;
  int width, height;  ///< pixels of the screen
};
/// The place that all slices go through, LPS mm.
struct Look {
  glm::dvec3 at_mm;
};
/// From where the volume is looked at; see `Camera`.
struct Turn {
  double angle_deg, elevation_deg, zoom;
  std::optional<glm::dvec3> target_mm;
};
/// The window of grey levels.
struct Levels {
  double width, level;
};
/// The transfer function of the volume, by name.
struct Style {
  std::string name;
};
struct Compare {
  Compared compared;
  double swipe;
};
/// What lies over the slices, if anything.
struct LayOver {
  std::optional<Layer> layer;
};
/// What is the value at a place? LPS mm.
struct Probe {
  glm::dvec3 at_mm;
};
/// A page has shown a picture.
struct Shown {
  Pane pane;
  std::uint32_t number;
};

// What a hand does; see `Session`. Places are those of the deformed picture.

struct Grip {
  Pointed at;
  double radius_mm;
};
struct Move {
  glm::dvec3 by_mm;
};
struct Release {};
struct Pin {
  Pointed at;
  double radius_mm;
};
struct Unpin {};
/// A cut along a line that was drawn on a picture.
struct Cut {
  std::vector<Pointed> path;  ///< at least two places
  glm::dvec3 along;           ///< direction of the blade, LPS, of any length
  double depth_mm;            ///< how deep it cuts
  bool is_centred;            ///< whether it cuts half as deep to either side of the line, else from the line on
  bool is_closed = false;     ///< whether the last place is joined to the first: a lasso
};
struct Suture {
  std::string name;
};
struct Reopen {
  std::string name;
};
struct Ball {
  Pointed at;
  double radius_mm;
};
struct LiftBall {};
struct Undo {};
struct Redo {};
/// Plays the phases of the scenario that the viewer was given, or its reel from the frame that is shown, or from the
/// first one after the last. A reel that is played stops.
struct Play {};
/// Shows a frame of the reel, from 0.
struct Frame {
  int number;
};
/// Takes back all.
struct Reset {};
/// Begins anew with another method.
struct Use {
  simulate::Method method;
};
/// Begins anew with other properties of the tissues.
struct Tissues {
  std::vector<simulate::Tissue> tissues;  ///< all of the scenario, by their names, in its order
};
/// What was done is to be kept.
struct Save {
  std::string name;       ///< of the files, without suffix
  std::string volume;     ///< suffix of the deformed volume, such as ".nii.gz"; "dicom" for a series; empty: none
  bool field = false;     ///< whether the field is
  bool pictures = false;  ///< whether what the panes show is
  std::string film = {};  ///< suffix of a film of all that happened, ".mp4" or ".gif"; empty: none
  Pane film_of = Pane::volume;
};

}  // namespace tetwarp::viewer::request

namespace tetwarp::viewer {

/// Something that is asked of a stage.
struct Request {
  std::variant<request::Size, request::Look, request::Turn, request::Levels, request::Style, request::Compare,
               request::LayOver, request::Probe, request::Shown, request::Grip, request::Move, request::Release,
               request::Pin, request::Unpin, request::Cut, request::Suture, request::Reopen, request::Ball,
               request::LiftBall, request::Play, request::Frame, request::Undo, request::Redo, request::Reset,
               request::Use, request::Tissues, request::Save>
      what;
  /// By which pictures say what they show. It rises from request to request; 0 for one that nothing is to be told of.
  std::uint32_t number = 0;
};

}  // namespace tetwarp::viewer
