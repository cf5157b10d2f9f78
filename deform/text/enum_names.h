// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string_view>

#include "deform/resampler.h"

namespace tetwarp {

/// The word for a choice on the command line, in reports and in messages, such as "background".
const char* name_of(Outside outside);
/// The word for an interpolation on the command line, in reports and in messages, such as "linear".
const char* name_of(Interpolation interpolation);
/// The interpolation that `name_of` calls by this name, or nothing for any other text.
std::optional<Interpolation> interpolation_named(std::string_view name);

}  // namespace tetwarp
