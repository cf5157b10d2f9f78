// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: the form in which tetwarp-read (isolated_read.h) answers, whatever the file is.
#include <string>
#include <vector>

namespace tetwarp {

/// A part of a file that was read: a name and two lists of numbers. What they are, the reader of its kind says.
struct ReadRecord {
  std::string name;
  std::vector<double> head;    ///< few numbers that say what `values` is
  std::vector<double> values;  ///< many
};

}  // namespace tetwarp
