// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string_view>

#include "deform/resampler.h"

namespace tetwarp {

/// Words of the command line, reports and messages.
const char* name_of(Outside outside);
const char* name_of(Interpolation interpolation);
std::optional<Interpolation> interpolation_named(std::string_view name);

}  // namespace tetwarp
