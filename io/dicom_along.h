// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>

#include "io/dicom_series.h"

namespace tetwarp {

/// A derived series that was written completely. Objects that go through the same field refer to it.
struct WrittenSeries {
  const DicomHeaders& source;      ///< headers of the series that was deformed
  const DicomWriteReport& report;  ///< what was written, with the new UIDs
  const Geometry& geometry;        ///< grid of the derived series
};

/// A dose or segmentation that goes through the same field as a series.
struct DicomAlong {
  std::filesystem::path source;  ///< file from which it was read
  std::string source_sha256;     ///< SHA-256 of that file, hexadecimal
  DicomDerivation derivation;    ///< its own parameters and description; of the form only the de-identification counts
};

/// What was written of such an object.
struct AlongReport {
  std::string series_uid,  ///< new Series Instance UID
      sop_instance_uid;    ///< new SOP Instance UID
};

}  // namespace tetwarp
