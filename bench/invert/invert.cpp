// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/invert/invert.h"

#include "bench/harness/files.h"
#include "bench/peers/peers.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

namespace {

constexpr char kTetwarp[] = "tetwarp";
constexpr double kTimesFaster = 50;

struct Named {
  const char *option, *name;
  ItkInverter inverter;
};
constexpr Named kItkInverters[] = {{"itk-invert", "ITK invert", ItkInverter::fixed_border},
                                   {"itk-invert-free", "ITK invert, border free", ItkInverter::free_border},
                                   {"itk-iterative", "ITK iterative", ItkInverter::iterative}};

/// As `tetwarp invert` does it.
InversePeer make_own(const VertexField& field, int threads) {
  const auto inverse =
      std::make_shared<PullField>(PullField{field.lattice, std::vector<glm::vec3>(field.displacement.size())});
  const std::shared_ptr<ForwardResampler> resampler = make_cpu_resampler(field.lattice, {.threads = threads});
  return [=, &field]() -> std::span<const glm::vec3> {
    resampler->set_field(view(field, Outside::background), {.jacobian_range = false});
    resampler->resample(whole(field.lattice), {}, {.inverse_mm = samples_of(*inverse)});
    return inverse->displacement;
  };
}

/// Where a field folds, no inverse is known, and Tetwarp takes another path: there the time is told and not held
/// against anything.
void add_peer(const Json& peer, const Json& own, Floors& floors) {
  const std::string where = peer["field"].get<std::string>() + ", " + peer["by"].get<std::string>();
  const bool known = !peer["mean_error"].is_null();
  floors.at_least("time / tetwarp's", where, number(peer, "/ms"), number(own, "/ms"),
                  known ? Floors::Limit(kTimesFaster) : std::nullopt);
  for (const std::string error : {"mean", "largest"})
    floors.at_least(error + " error / tetwarp's", where, number(peer, "/" + error + "_error"),
                    number(own, "/" + error + "_error"), 1);
}

}  // namespace

Json inverse_json(const std::string& field, const std::string& by, const Samples& times, const Accuracy& found) {
  return {{"field", field},
          {"by", by},
          {"ms", summary_of(times, "ms")},
          {"cpu_ms", summary_of(times, "cpu_ms")},
          {"mean_error", number_or_null(found.mean)},
          {"percentile_99_error", number_or_null(found.percentile_99)},
          {"largest_error", number_or_null(found.largest)},
          {"with_source", found.with_source},
          {"left_out", found.left_out},
          {"without_source", found.without_source},
          {"written_without_source", found.written},
          {"zero_without_source", found.zero},
          {"pointing_in_without_source", found.pointing_in}};
}

Json measure_invert(const Options& options) {
  const int threads = describe_machine(-1, options.threads)["threads"];
  Json rows = Json::array();
  for (const std::string& name : options.fields) {
    const KnownField known = make_known_field(name, options.input.phantom_size(), threads);
    std::vector<Contender> contenders;
    std::vector<std::span<const glm::vec3>> inverses(1 + std::size(kItkInverters));
    const auto add = [&](const char* by, const InversePeer& peer) {
      if (peer) contenders.push_back(timed(by, [peer, &found = inverses[contenders.size()]] { found = peer(); }));
    };
    add(kTetwarp, make_own(known.field, threads));
    for (const Named& itk : kItkInverters)
      if (options.has_peer(itk.option)) add(itk.name, make_itk_inverter(itk.inverter, known.field, threads));
    // Tetwarp allocates in its first run; one of ITK's takes too long to be thrown away.
    for (std::size_t n = 1; n < contenders.size(); ++n) contenders[n].warms_up = false;
    const auto say = [&](const std::string& line) { options.say(name + " " + line); };
    const std::vector<Samples> times = take_turns(contenders, 1, options.repeats, say);
    for (std::size_t n = 0; n < contenders.size(); ++n)
      rows.push_back(inverse_json(name, contenders[n].name, times[n], compare_inverse(known, inverses[n])));
  }
  return rows;
}

Floors find_invert_floors(const Json& document) {
  Floors floors;
  const Json& runs = rows_of(document, "runs");
  for (const Json& run : runs) {
    const Json* own = find_row(runs, {{"field", run["field"]}, {"by", kTetwarp}});
    if (run["by"] == kTetwarp) {
      floors.at_most("written without a source", run["field"], number(run, "/written_without_source"), 1, 0);
      floors.at_most("left out with a source", run["field"], number(run, "/left_out"), 1, 0);
    } else if (own) {
      add_peer(run, *own, floors);
    }
  }
  return floors;
}

int run_invert(const Options& options) {
  require_writable(options.json);
  Json document = begin_document("invert",
                                 {{"fields", options.fields},
                                  {"peers", options.peers},
                                  {"width", options.input.width},
                                  {"slices", options.input.slices.front()},
                                  {"repeats", options.repeats}},
                                 describe_machine(-1, options.threads), "");
  document["itk"] = itk_version() ? Json(*itk_version()) : Json(nullptr);
  document["runs"] = measure_invert(options);
  return conclude(document, find_invert_floors(document), options);
}

}  // namespace tetwarp::bench
