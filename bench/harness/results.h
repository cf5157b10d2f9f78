// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// What was measured, as values. A row is a measurement: the names of its case (field, size, method), its times as
// summaries, and figures of quality. A document has facts of the run and lists of rows; it is what --json writes, what
// is printed as plain tables, what floors are found in, and what bench/publish.py makes documents of.
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/harness/options.h"
#include "bench/harness/turns.h"

namespace tetwarp::bench {

/// Names stay in the order in which they were given.
using Json = nlohmann::ordered_json;

/// printf into a string, at most 511 characters.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// Value below which a fraction of `sorted` lies, linear between neighbours: fraction * (n - 1) counts from the first.
/// @param sorted  rising, not empty
double quantile(const std::vector<double>& sorted, double fraction);
/// {median, q1, q3, min, max, frames}. @throws InputError for no values
Json summarize(std::vector<double> values);
/// Of the samples of a name; null where there are none.
Json summary_of(const Samples& samples, const std::string& name);
/// Null for what is not finite.
Json number_or_null(double value);
Json size_json(const glm::i64vec3& size);

/// The number at a JSON pointer of a row, of times their median: "/new_field_ms", "/paper/ms". None where it was not
/// measured.
std::optional<double> number(const Json& row, const std::string& pointer);
/// A list of a document; an empty one where there is none.
const Json& rows_of(const Json& document, const char* list);
/// The first row of a list that has these values; null where there is none.
const Json* find_row(const Json& rows, const Json& like);

/// What the machine is. @param device  of CUDA; -1: none is used. @param threads  0: all
Json describe_machine(int device, int threads);
/// Bytes of memory that programs may take without swapping (/proc/meminfo, MemAvailable); the largest number where that
/// is not known.
std::uint64_t available_bytes();

/// The beginning of a document. @param kind  of the input: "phantom", with its seed, or what else was read; empty: none
Json begin_document(const std::string& family, const Json& options, const Json& machine, const std::string& kind);

/// A ratio within one run, or a count, and what it should be.
struct Floor {
  std::string ratio;  ///< "paper / resample", "written without a source"
  std::string where;  ///< "wave", "wave, cells of 4"
  double value = 0;
  bool at_least = true;  ///< otherwise at most
  std::optional<double> required = {}, aim = {};

  bool meets(double limit) const { return at_least ? value >= limit : value <= limit; }
};

class Floors : public std::vector<Floor> {
 public:
  using Limit = std::optional<double>;

  /// A quotient that is to be so large, or so small; none where one of the two was not measured.
  void at_least(const std::string& ratio, const std::string& where, Limit over, Limit under, Limit required,
                Limit aim = {}) {
    add(ratio, where, over, under, true, required, aim);
  }
  void at_most(const std::string& ratio, const std::string& where, Limit over, Limit under, Limit required,
               Limit aim = {}) {
    add(ratio, where, over, under, false, required, aim);
  }

 private:
  void add(const std::string& ratio, const std::string& where, Limit over, Limit under, bool at_least, Limit required,
           Limit aim) {
    if (over && under) push_back({ratio, where, *over / *under, at_least, required, aim});
  }
};

/// Whether no floor is missed that is required; aims do not count.
bool all_met(const Floors& floors);
Json to_json(const Floors& floors);

/// The facts, and a plain table of every list of rows: what nothing was measured of has no column, and what is the same
/// in all rows stands above them.
std::string to_text(const Json& document, const Floors& floors);
/// A line a row; the first names the columns. Of times there are six, of sizes three.
std::string to_csv(const Json& rows);

/// Keys in the order of the alphabet. An empty path writes nothing.
void write_json(const std::filesystem::path& path, const Json& document);

/// What a command with floors does at last: prints the document, writes it, and says whether a floor is missed that is
/// required.
/// @return the exit status
int conclude(Json document, const Floors& floors, const Options& options);

}  // namespace tetwarp::bench
