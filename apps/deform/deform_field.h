// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/deform/deform_plan.h"
#include "apps/fields/read_field.h"
#include "apps/simulate/simulated_field.h"

namespace tetwarp::apps {

/// The voxels that a run deforms.
struct DeformInputs {
  std::shared_ptr<const InputVolume> input;
  std::shared_ptr<const DicomHeaders> headers;  ///< of a series: this run's own, for one thread at a time reads them
  double background = 0;
  std::vector<AlongInput> along;
  double seconds = 0;

  const Geometry& grid() const { return input->volume.geometry(); }
  std::optional<PaddingRange> padding() const { return input->is_dicom() ? input->dicom->padding : std::nullopt; }
};

/// Reads voxels. @param input  which other runs may read as well. @throws InputError; Cancelled
DeformInputs read_inputs(const DeformRequest& request, const DeformHeaders& headers,
                         std::shared_ptr<SharedInput> input);

/// The field of a run, and the grid that it leads onto.
struct DeformField {
  AnyField field;
  FieldOrigin origin;
  std::optional<SimulationSource> simulation;  ///< of a simulated one
  std::vector<std::string> warnings;           ///< for people, of a simulation
  std::string sha256;
  Geometry grid;   ///< of the output
  AnyVolume room;  ///< for the output, on that grid
  double seconds = 0;
};

/// Reads, evaluates or simulates the field, and makes room for what comes out: all that needs no device, unless one
/// simulates. A formula needs no disk. @param worker  of a simulation
DeformField make_field(const DeformRequest& request, const DeformPlan& plan, const DeformInputs& inputs,
                       const Worker& worker);

}  // namespace tetwarp::apps
