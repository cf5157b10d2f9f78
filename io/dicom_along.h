// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>

#include "io/dicom_series.h"

namespace tetwarp {

/// A derived series that was written whole: what objects that go through the same field refer to.
struct WrittenSeries {
  const DicomHeaders& source;  ///< of the series that was deformed
  const DicomWriteReport& report;
  const Geometry& geometry;
};

/// A dose or segmentation that goes along with a series.
struct DicomAlong {
  std::filesystem::path source;  ///< the file that it was read from
  std::string source_sha256;
  DicomDerivation derivation;  ///< its own parameters and description; of its form only the de-identification
};

/// What was written of it.
struct AlongReport {
  std::string series_uid, sop_instance_uid;
};

}  // namespace tetwarp
