// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_field.h"

#include "apps/deform/output_grid.h"
#include "deform/field_check.h"

namespace tetwarp::apps {

namespace {

template <class Read>
DeformField taken(Read read) {
  DeformField made;
  made.field = std::move(read.field);
  made.origin = std::move(read.origin);
  return made;
}

DeformField taken(SimulatedField simulated) {
  DeformField made;
  made.field = std::move(simulated.field);
  made.simulation = std::move(simulated.source);
  made.warnings = std::move(simulated.warnings);
  return made;
}

/// Refuses points that would rest beyond the grid of the first of several pull fields, for the others move them.
/// @throws InputError where the grid does not reach over the output
void require_all_apply(const PullChoice& choice, const PullField& field, const Geometry& output, Outside outside) {
  if (outside != Outside::rest || choice.fields.size() == 1) return;
  try {
    make_pull_frame(output, view(field, Outside::refuse));
  } catch (const InputError&) {
    throw InputError("--outside rest, but " + choice.fields.front().text +
                     " does not reach over the whole output: beyond its grid points would rest, though the fields "
                     "behind it move them; choose --outside background, or --grid with the grid of that file");
  }
}

DeformField field_of(const DeformRequest& request, const DeformPlan& plan, const DeformInputs& inputs,
                     const Worker& worker, const Control& control) {
  if (const auto* simulated = std::get_if<Simulated>(&request.field))
    return taken(simulate_field(request.options, simulated->scenario, inputs.input->volume.view(), worker, control));
  const int threads = request.options.common.threads;
  const auto& choice = std::get<FieldChoice>(request.field);
  if (const auto* pull = std::get_if<PullChoice>(&choice)) {
    ReadPullField read = read_field(*pull, plan.grid.value(), threads, control);
    require_all_apply(*pull, read.field, *plan.grid, request.options.outside);
    return taken(std::move(read));
  }
  return taken(read_field(std::get<ForwardChoice>(choice), inputs.grid(), threads, control));
}

/// The note for a run whose INPUT has a grid that no output can have.
std::string note_of_straightening(const Geometry& input, const Geometry& output) {
  return std::string("INPUT's slices ") + (is_sheared(input) ? "lean" : "lie at uneven distances") +
         ": the output has a straight, even grid of " + to_string(output.size) +
         " voxels, so that the identity resamples too";
}

}  // namespace

DeformInputs read_inputs(const DeformRequest& request, const DeformHeaders& headers,
                         std::shared_ptr<SharedInput> input) {
  const DeformOptions& options = request.options;
  Stage stage(options.common, "read");
  DeformInputs inputs;
  inputs.input = {input, &input->read(options.common, stage.control())};
  inputs.headers = input->headers();
  inputs.background = options.background.value_or(inputs.input->background);
  inputs.along = read_along(headers.along.volumes, options.common, {.stop = interrupt_token()});
  inputs.seconds = stage.seconds();
  return inputs;
}

DeformField make_field(const DeformRequest& request, const DeformPlan& plan, const DeformInputs& inputs,
                       const Worker& worker) {
  const DeformOptions& options = request.options;
  Stage stage(options.common, "field");
  DeformField made = field_of(request, plan, inputs, worker, stage.control());
  made.grid = plan.grid ? *plan.grid : fitting_grid(inputs.grid(), std::get<VertexField>(made.field), options.outside);
  if (is_same_grid(options.grid) && made.grid != inputs.grid())
    made.origin.notes.push_back(note_of_straightening(inputs.grid(), made.grid));
  made.sha256 = hash_field(made.field, options.common.threads);
  made.room = AnyVolume(made.grid, inputs.input->volume.type());
  made.seconds = stage.seconds();
  return made;
}

}  // namespace tetwarp::apps
