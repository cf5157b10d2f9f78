// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/in_background.h"
#include "apps/deform/deform_write.h"
#include "backend/devices.h"

namespace tetwarp::apps {

int run_deform(const DeformOptions& options) {
  const DeformRequest request = request_of(options);
  DeformOutputs outputs = begin_outputs(request);
  auto input = std::make_shared<SharedInput>(options.input, SharedInput::Users::one);
  if (options.dry_run) {
    const DeformHeaders headers = open_headers(request, *input, outputs.set);
    say(options.common, describe(plan_deformation(request, headers), request));
    return 0;
  }
  const auto awake = in_background([&] {  // while headers and voxels are read
    if (runs_on_device(chosen(options.backend))) wake_device(options.device);
  });
  const Worker worker{options.backend, options.device};
  const DeformHeaders headers = open_headers(request, *input, outputs.set);
  const DeformPlan plan = plan_deformation(request, headers);
  DeformInputs inputs = read_inputs(request, headers, input);
  DeformField field = make_field(request, plan, inputs, worker);
  DeformSinks sinks = open_sinks(request, inputs, field, outputs);
  DeformResult result = resample(request, headers, inputs, field, std::move(field.room), sinks, worker);
  const DeformRun run{request, plan, headers, inputs, field, result};
  const DeformWritten written = write_outputs(run, std::move(sinks), outputs, input->sha256());
  std::vector<std::string> lines;
  for (const std::string& note : notes_of(run, written)) lines.push_back("tetwarp: " + note);
  lines.push_back(summary(run));
  input.reset();
  commit_outputs(outputs, std::move(inputs), std::move(field), std::move(result));
  for (const std::string& line : lines) say(options.common, line);
  return 0;
}

}  // namespace tetwarp::apps
