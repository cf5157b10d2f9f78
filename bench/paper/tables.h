// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// The tables of the paper with Tetwarp's rows, what each result is worth, and Appendix A, in Markdown.
std::string to_markdown(const Results& results);

}  // namespace tetwarp::bench
