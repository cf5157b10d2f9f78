// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/cli/options.h"
#include "io/dicom_series.h"

namespace tetwarp::apps {

/// What a folder of DICOM files holds, for scripts; the keys stand in docs/reference/dicom.md.
nlohmann::json describe(const DicomScan& scan, const InputOptions& input);

/// The same to standard output, in words for people.
void print(const DicomScan& scan, const InputOptions& input);

}  // namespace tetwarp::apps
