// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <memory>

#include "deform/resampler.h"

namespace tetwarp {

/// A resampler of all forward fields: it has one resampler for lattices and one for meshes. It keeps one of them at a
/// time, so that their buffers do not add up. A lattice with replaced cells is taken as one mesh.
class LatticeOrMesh final : public ForwardResampler {
 public:
  using Make = std::function<std::unique_ptr<ForwardResampler>()>;

  /// @param lattice, mesh  make the resampler of that kind; whatever the first throws, this throws
  LatticeOrMesh(const Geometry& output, Make lattice, Make mesh)
      : ForwardResampler(output),
        make_lattice_(std::move(lattice)),
        make_mesh_(std::move(mesh)),
        current_(make_lattice_()) {}

  void set_field(const FieldView& field, const FieldOptions& options, const Control& control) override {
    const bool is_mesh = field.mesh != nullptr;
    if (is_mesh != holds_mesh_ || !current_) {
      current_.reset();
      current_ = is_mesh ? make_mesh_() : make_lattice_();
      holds_mesh_ = is_mesh;
    }
    require(is_mesh || field.replaced.empty(), "a field with replaced cells needs a mesh in their place");
    current_->set_field(field, options, control);
  }
  Region source_region(const Geometry& source, Region region) const override {
    return held().source_region(source, region);
  }
  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override {
    return held().resample(region, targets, maps, control, finished);
  }
  Update update(std::span<const Target> targets, const Control& control, std::span<const ValueRange> seen) override {
    return held().update(targets, control, seen);
  }

 private:
  ForwardResampler& held() const {
    require(current_ != nullptr, "a resampler needs a field: call set_field first");
    return *current_;
  }

  Make make_lattice_, make_mesh_;
  std::unique_ptr<ForwardResampler> current_;
  bool holds_mesh_ = false;
};

}  // namespace tetwarp
