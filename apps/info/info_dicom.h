// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/cli/options.h"
#include "io/dicom_series.h"

namespace tetwarp::apps {

/// Describes for scripts what a folder of DICOM files holds; docs/reference/dicom.md lists the keys.
nlohmann::json describe(const DicomScan& scan, const InputOptions& input);

/// Prints for people, on standard output, what a folder of DICOM files holds.
void print(const DicomScan& scan, const InputOptions& input);

}  // namespace tetwarp::apps
