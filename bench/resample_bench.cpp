// tetwarp-bench cpu: what the stages of one deformation cost on this machine, per voxel.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/options.h"
#include "bench/output_file.h"
#include "deform/fields/formula.h"
#include "deform/phantom.h"
#include "deform/resampler.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Clock = std::chrono::steady_clock;

struct Times {
  double formula_ns, set_field_ns, resample_ns;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Medians over `repeats`, in ns a voxel of the output.
Times measure(const Volume<std::int16_t>& ct, const std::string& formula, std::int64_t cell_size, int threads,
              int repeats) {
  const Limits limits{.threads = threads};
  const auto per_voxel = [&](Clock::time_point from, Clock::time_point to) {
    return std::chrono::duration<double, std::nano>(to - from).count() / static_cast<double>(voxel_count(ct.geometry));
  };
  std::vector<double> formula_ns, set_field_ns, resample_ns;
  const auto resampler = make_cpu_resampler(ct.geometry, limits);
  Volume<std::int16_t> output{ct.geometry, std::vector<std::int16_t>(ct.voxels.size())};
  for (int n = 0; n < repeats; ++n) {
    const auto start = Clock::now();
    const VertexField field =
        sample_on(lattice_over(ct.geometry, cell_size), parse_formula(formula, ct.geometry), limits);
    const auto made = Clock::now();
    resampler->set_field(view(field));
    const auto set = Clock::now();
    const Target target{.source = view(ct), .output = view(output), .background = -1024};
    resampler->resample(whole(ct.geometry), {&target, 1});
    const auto done = Clock::now();
    formula_ns.push_back(per_voxel(start, made));
    set_field_ns.push_back(per_voxel(made, set));
    resample_ns.push_back(per_voxel(set, done));
  }
  return {median(formula_ns), median(set_field_ns), median(resample_ns)};
}

/// Every formula with cells of three sizes, a line each.
nlohmann::json measure_all(const Volume<std::int16_t>& ct, const CpuOptions& options) {
  nlohmann::json runs = nlohmann::json::array();
  for (const std::string formula :
       {"identity", "wave:amplitude=8,wavelength=64", "twist:angle=28.6", "bubble:radius=128,strength=0.3"}) {
    for (const std::int64_t cell_size : {1, 4, 16}) {
      const Times times = measure(ct, formula, cell_size, options.threads, options.repeats);
      std::printf("%-34s cell %2lld  %7.1f %7.1f %7.1f\n", formula.c_str(), static_cast<long long>(cell_size),
                  times.formula_ns, times.set_field_ns, times.resample_ns);
      runs.push_back({{"field", formula},
                      {"cell_size", cell_size},
                      {"formula_ns", times.formula_ns},
                      {"set_field_ns", times.set_field_ns},
                      {"resample_ns", times.resample_ns}});
    }
  }
  return runs;
}

}  // namespace

int run_cpu(const CpuOptions& options) {
  require_writable(options.json);
  const Volume<std::int16_t> ct = make_phantom({512, 512, options.slices}, {1, 1, 1}, 1);
  nlohmann::json results = {
      {"commit", commit()}, {"slices", options.slices}, {"threads", options.threads}, {"repeats", options.repeats}};
  std::printf("512 x 512 x %lld, ns a voxel: formula, set_field, resample\n", static_cast<long long>(options.slices));
  results["runs"] = measure_all(ct, options);
  if (options.json.empty()) {
    std::printf("%s\n", results.dump().c_str());
  } else {
    write_text(options.json, results.dump() + "\n");
  }
  return 0;
}

}  // namespace tetwarp::bench
