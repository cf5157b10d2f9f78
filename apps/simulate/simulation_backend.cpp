// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/simulate/simulation_backend.h"

#include "cuda/backend.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"

namespace tetwarp::apps {

SimulationBackend make_simulation_backend(simulate::Method method, const std::string& wanted, int device,
                                          const Limits& limits) {
  using simulate::Method;
  using simulate::Model;
  if (means_cuda(wanted)) {
    return {"cuda", [method, device](const Model& model) {
              return method == Method::chainmail ? simulate::make_cuda_chainmail(model, device)
                                                 : simulate::make_cuda_mass_spring(model, {}, device);
            }};
  }
  return {"cpu", [method, limits](const Model& model) {
            return method == Method::chainmail ? simulate::make_cpu_chainmail(model, limits)
                                               : simulate::make_cpu_mass_spring(model, {}, limits);
          }};
}

}  // namespace tetwarp::apps
