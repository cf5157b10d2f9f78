// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <variant>

#include "backend/factories.h"

namespace tetwarp::viewer {

/// A field of either direction.
using AnyField = std::variant<VertexField, PullField>;
using AnyFieldView = std::variant<FieldView, PullFieldView>;

/// A view of a field in host memory, outside which voxels get the background.
AnyFieldView view_of(const AnyField& field);

/// Resamples by fields of either direction, one after the other.
class Deformer {
 public:
  /// @param grid  output grid  @throws what `make_forward_resampler` throws
  Deformer(BackendKind backend, const Geometry& grid, int device, const Limits& limits);

  /// Takes a field, which must not change until the next one is taken. @param options  of a forward field
  void set_field(const AnyFieldView& field, const FieldOptions& options, const Control& control = {});
  /// The resampler of the last field.
  Resampler& operator*() const { return *now(); }
  Resampler* operator->() const { return &*now(); }
  /// As `ForwardResampler::update`; of a pull field all voxels are new.
  Update update(std::span<const Target> targets, const Control& control);

 private:
  const AnyResampler& now() const { return pulls_ ? pull_ : forward_; }

  Geometry grid_;
  int device_;
  Limits limits_;
  AnyResampler forward_, pull_;  ///< `pull_` is made for the first pull field
  bool pulls_ = false;
};

}  // namespace tetwarp::viewer
