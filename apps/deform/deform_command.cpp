// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/in_background.h"
#include "apps/deform/deformation.h"
#include "cuda/devices.h"

namespace tetwarp::apps {

int run_deform(const DeformOptions& options) {
  Deformation deformation(options);
  if (options.dry_run) {
    deformation.open();
    say(options.common, describe(deformation.record().plan, options, deformation.record().outputs));
    return 0;
  }
  const auto awake = in_background([&] {  // beside reading
    if (means_cuda(options.backend)) wake_cuda_device(options.device);
  });
  const Worker worker{options.backend, options.device};
  deformation.open();
  deformation.read();
  deformation.make_field(worker);
  deformation.resample(worker);
  deformation.write();
  deformation.commit();
  for (const std::string& note : deformation.notes()) say(options.common, "tetwarp: " + note);
  say(options.common, summary(deformation.record()));
  return 0;
}

}  // namespace tetwarp::apps
