// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <stdexcept>

#include "io/dicom_series.h"

namespace tetwarp {

/// The series of a folder or a file, which must hold one, with one volume.
inline DicomSeries only_series(const std::filesystem::path& path) {
  DicomScan scan = scan_dicom(path);
  if (scan.series.size() != 1)
    throw std::runtime_error(std::to_string(scan.series.size()) + " series or volumes, expected one");
  return scan.series.front();
}

}  // namespace tetwarp
