// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/deformer.h"

namespace tetwarp::viewer {

AnyFieldView view_of(const AnyField& field) {
  return std::visit([](const auto& one) -> AnyFieldView { return view(one, Outside::background); }, field);
}

Deformer::Deformer(BackendKind backend, const Geometry& grid, int device, const Limits& limits)
    : grid_(grid), device_(device), limits_(limits), forward_(backend, Direction::forward, grid, device, limits) {}

void Deformer::set_field(const AnyFieldView& field, const FieldOptions& options, const Control& control) {
  pulls_ = std::holds_alternative<PullFieldView>(field);
  if (!pulls_) return forward_.forward().set_field(std::get<FieldView>(field), options, control);
  if (!pull_) pull_ = AnyResampler(forward_.backend(), Direction::pull, grid_, device_, limits_);
  pull_.pull().set_field(std::get<PullFieldView>(field), control);
}

Update Deformer::update(std::span<const Target> targets, const Control& control) {
  if (!pulls_) return forward_.forward().update(targets, control);
  return {pull_->resample(whole(grid_), targets, {}, control), {whole(grid_)}};
}

}  // namespace tetwarp::viewer
