// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>

namespace tetwarp {

/// From `begin` up to `end`, bytes of a text.
struct TextSpan {
  std::size_t begin = 0, end = 0;
};

}  // namespace tetwarp
