// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>

#include "apps/cli/options.h"
#include "apps/fields/field_choice.h"
#include "view/session/stage.h"

namespace tetwarp::apps {

/// The fields that are shown instead of what a hand does, parsed.
struct ViewFields {
  std::optional<FieldChoice> growing;
  std::vector<ForwardChoice> sequence;  ///< instead: one a frame

  bool any() const { return growing || !sequence.empty(); }
};
/// @throws UsageError for what `parse_field` refuses
ViewFields parse_view_fields(const ViewOptions& options);

/// Frames of a field that grows.
inline constexpr int kGrowthFrames = 25;

/// Reads a field that grows. Of a sequence each is read when it is shown.
/// @param fields  must outlive the reel
/// @param volume  grid of INPUT  @param grid  of the deformed volume
/// @throws InputError for what cannot be read; Cancelled
viewer::Reel read_reel(const ViewFields& fields, const Geometry& volume, const Geometry& grid, int threads,
                       const Control& control);

}  // namespace tetwarp::apps
