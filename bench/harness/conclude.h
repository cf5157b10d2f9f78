// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "bench/harness/floors.h"
#include "bench/harness/output_file.h"

namespace tetwarp::bench {

/// What a command that has floors does at last: prints its tables, writes its numbers, and says whether a floor that
/// is required is missed.
/// @param results  with `find_floors`, `to_markdown` and `to_json`  @param json  may be empty
/// @param check  a missed floor is a failure  @return the exit status
template <class Results>
int conclude(const Results& results, const std::filesystem::path& json, bool check) {
  const std::vector<Floor> floors = find_floors(results);
  std::cout << to_markdown(results, floors);
  write_text(json, to_json(results, floors).dump(1) + "\n");
  if (!check || all_met(floors)) return 0;
  std::fprintf(stderr, "tetwarp-bench: a floor is missed; the last table says which\n");
  return 1;
}

}  // namespace tetwarp::bench
