// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/markdown.h"

#include <cstdarg>
#include <cstdio>

namespace tetwarp::bench {

namespace {

std::string ms_text(double ms) { return format("%.*f", ms < 10 ? 3 : (ms < 100 ? 2 : 1), ms); }

}  // namespace

std::string format(const char* pattern, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

std::string cell(const std::optional<Summary>& ms) {
  if (!ms) return "-";
  return ms_text(ms->median) + " (" + ms_text(ms->q1) + "-" + ms_text(ms->q3) + ")";
}

std::string cell(const std::optional<double>& ratio) { return ratio ? format("%.2f", *ratio) : "-"; }

std::string row(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& text : cells) line += " " + text + " |";
  return line + "\n";
}

std::string heading(const std::vector<std::string>& names) {
  std::string rule = "|";
  for (std::size_t n = 0; n < names.size(); ++n) rule += " --- |";
  return row(names) + rule + "\n";
}

std::string cuda_text(const Machine& machine) {
  return machine.gpu.value_or("?") + ", compute capability " + machine.compute_capability.value_or("?") + ", driver " +
         machine.driver.value_or("?") + ", runtime " + machine.cuda_runtime.value_or("?");
}

}  // namespace tetwarp::bench
