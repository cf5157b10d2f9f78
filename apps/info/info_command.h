// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/cli/options.h"

namespace tetwarp::apps {

/// What `info --json` prints of a file or folder. @throws InputError for what cannot be read
nlohmann::json info_document(const InfoOptions& options);

}  // namespace tetwarp::apps
