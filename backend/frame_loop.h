// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "backend/backend.h"
#include "deform/render/renderer.h"
#include "deform/simulate/scenario_run.h"

namespace tetwarp {

/// A frame of a scenario, as `FrameLoop` shows it.
struct ShownFrame {
  simulate::FrameResult simulated;    ///< what became of it
  Report report;                      ///< of the target
  std::span<const std::uint8_t> rgb;  ///< red, green and blue of each pixel, rows from the top, until the next call
};

/// Plays a scenario, deforms a volume by each frame and makes a picture of it.
///
/// On a device three frames are worked on at a time: while one is drawn, the volume is deformed for the next, and the
/// one after that is simulated. So a frame that is shown is two steps old. Volumes and pictures are those of a loop
/// that does one after the other. Voxels that a frame does not change are not computed again
/// (`ForwardResampler::update`), nor are, where that is allowed, those that no picture shows. On the CPU, which all
/// would share, one follows the other.
class FrameLoop {
 public:
  /// What the loop works with. All must outlive it, and nobody else may use them meanwhile.
  struct Parts {
    simulate::ScenarioRun& run;   ///< what is played, from its next frame on
    ForwardResampler& resampler;  ///< onto the grid of the target's output
    Renderer& renderer;           ///< with a style
    Target target;                ///< whose output is drawn; in the memory of the backend, for pictures without copies
    Outside outside = Outside::background;  ///< what becomes of voxels outside the undeformed lattice
    /// Where pictures are all that is wanted: the values that they show (`seen_values`). Then voxels of which nothing
    /// is seen may stay as they are (`ForwardResampler::update`). Empty: the volume of each frame is whole.
    std::vector<ValueRange> seen = {};
  };

  /// @param parts    what the loop works with
  /// @param backend  where the parts work
  /// @param device   number of their device
  explicit FrameLoop(const Parts& parts, BackendKind backend, int device = 0);
  /// Ends the simulation of the frame that would be next.
  ~FrameLoop();
  FrameLoop(const FrameLoop&) = delete;
  FrameLoop& operator=(const FrameLoop&) = delete;

  /// Whether the last frame was shown.
  bool is_done() const;
  /// Shows the next frame. The output of the target belongs to the loop until the last frame was shown: on a device it
  /// is being deformed for the next frame when this returns.
  /// @param plane  pixels and rays of the picture
  /// @throws InputError, DeviceError and others, as the parts do; what a frame's simulation throws, when that frame is
  /// due
  ShownFrame next(const ViewPlane& plane);

 private:
  class Implementation;
  std::unique_ptr<Implementation> it_;
};

}  // namespace tetwarp
