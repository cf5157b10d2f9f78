#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bench/cpu_bench.h"
#include "bench/cpu_report.h"
#include "bench/output_file.h"

namespace tetwarp::bench {

int run_cpu(const CpuOptions& options) {
  require_writable(options.json);
  const CpuResults results = measure_cpu(options, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  const std::vector<Floor> floors = find_floors(results);
  std::cout << to_markdown(results, floors);
  write_text(options.json, to_json(results, floors).dump(1) + "\n");
  if (!options.check || all_met(floors)) return 0;
  std::fprintf(stderr, "tetwarp-bench: a floor is missed; the last table says which\n");
  return 1;
}

}  // namespace tetwarp::bench
