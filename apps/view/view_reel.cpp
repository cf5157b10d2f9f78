// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/view/view_reel.h"

#include <memory>

#include "apps/cli/console.h"
#include "apps/fields/any_field.h"
#include "apps/fields/read_field.h"

namespace tetwarp::apps {

ViewFields parse_view_fields(const ViewOptions& options) {
  ViewFields fields;
  if (options.field.is_given()) fields.growing = parse_field(options.field, options.common.nifti_frame);
  fields.sequence = parse_sequence(options.sequence, options.field.cell_size, options.common.nifti_frame);
  return fields;
}

viewer::Reel read_reel(const ViewFields& fields, const Geometry& volume, const Geometry& grid, int threads,
                       const Control& control) {
  viewer::Reel reel;
  if (!fields.sequence.empty()) {
    reel.frames = static_cast<int>(fields.sequence.size());
    reel.field = [&all = fields.sequence, volume, threads](int frame) -> AnyField {
      const ForwardChoice& one = all[static_cast<std::size_t>(frame)];
      return apps::read_field(one, volume, threads, {.stop = interrupt_token()}).field;
    };
    return reel;
  }
  auto whole = std::make_shared<AnyField>();
  if (const auto* pull = std::get_if<PullChoice>(&*fields.growing))
    *whole = apps::read_field(*pull, grid, threads, control).field;
  else
    *whole = apps::read_field(std::get<ForwardChoice>(*fields.growing), volume, threads, control).field;
  reel.frames = kGrowthFrames;
  reel.grows = true;
  reel.pulls = is_pull(*whole);
  reel.field = [whole](int frame) { return scaled(*whole, static_cast<double>(frame) / (kGrowthFrames - 1)); };
  return reel;
}

}  // namespace tetwarp::apps
