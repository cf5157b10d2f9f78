// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/invert/invert_bench.h"

#include <algorithm>

#include "bench/harness/machine.h"
#include "bench/harness/turns.h"
#include "bench/peers/peers.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

namespace {

struct Named {
  const char *option, *name;
  ItkInverter inverter;
};
constexpr Named kItkInverters[] = {{"itk-invert", "ITK invert", ItkInverter::fixed_border},
                                   {"itk-invert-free", "ITK invert, border free", ItkInverter::free_border},
                                   {"itk-iterative", "ITK iterative", ItkInverter::iterative}};

/// As `tetwarp invert` does it.
class OwnInverse final : public InversePeer {
 public:
  OwnInverse(const VertexField& field, int threads)
      : field_(field),
        resampler_(make_cpu_resampler(field.lattice, {.threads = threads})),
        inverse_{field.lattice, std::vector<glm::vec3>(field.displacement.size())} {}

  void run() override {
    resampler_->set_field(view(field_, Outside::background), {.jacobian_range = false});
    resampler_->resample(whole(field_.lattice), {}, {.inverse_mm = samples_of(inverse_)});
  }
  std::span<const glm::vec3> inverse() const override { return inverse_.displacement; }

 private:
  const VertexField& field_;
  std::unique_ptr<ForwardResampler> resampler_;
  PullField inverse_;
};

struct Contender {
  std::string name;
  std::unique_ptr<InversePeer> peer;
};

std::vector<Contender> make_contenders(const InvertOptions& options, const VertexField& field, int threads) {
  std::vector<Contender> contenders;
  contenders.push_back({kTetwarp, std::make_unique<OwnInverse>(field, threads)});
  for (const Named& itk : kItkInverters) {
    if (std::find(options.peers.begin(), options.peers.end(), itk.option) == options.peers.end()) continue;
    auto peer = make_itk_inverter(itk.inverter, field, threads);
    if (peer) contenders.push_back({itk.name, std::move(peer)});
  }
  return contenders;
}

}  // namespace

InvertResults measure_invert(const InvertOptions& options, const std::function<void(const std::string&)>& say) {
  InvertResults results{
      .options = options, .machine = describe_machine(-1, options.threads), .itk = itk_version(), .runs = {}};
  const int threads = results.machine.threads;
  for (const std::string& name : options.fields) {
    const KnownField known = make_known_field(name, {options.width, options.width, options.slices}, threads);
    const std::vector<Contender> contenders = make_contenders(options, known.field, threads);
    contenders.front().peer->run();  // it allocates; a first run of ITK's takes too long to be thrown away
    Turns turns;
    for (const Contender& one : contenders) turns.add(name, one.name, nothing([&] { one.peer->run(); }));
    const std::vector<IoTime> times = turns.run(options.repeats, say);
    for (std::size_t n = 0; n < contenders.size(); ++n) {
      results.runs.push_back({.field = name,
                              .by = contenders[n].name,
                              .ms = times[n].ms,
                              .cpu_ms = times[n].cpu_ms,
                              .accuracy = compare_inverse(known, contenders[n].peer->inverse())});
    }
  }
  return results;
}

}  // namespace tetwarp::bench
