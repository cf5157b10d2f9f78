// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: writing Deformable Spatial Registration objects (PS3.3 A.39.2, C.20.3).
#include <functional>
#include <memory>

#include "io/dicom/derive/dicom_derive.h"
#include "io/image_file.h"

namespace tetwarp {

/// What an object has to know of the series beside it.
struct Registration {
  const DicomHeaders& source;
  const DerivedSeries& series;
  const DicomDerivation& derivation;
  /// Gives SOP Instance UIDs of the derived slices, empty for those that are not written. It is called after the last
  /// vector.
  std::function<std::vector<std::string>()> instances;
};

/// Begins an object that samples the source where the derived series' points come from: vectors x0 - p (mm, LPS) on the
/// grid of that series, NaN where there is no source. What `registration` refers to must outlive the writer.
///
/// The vectors wait on the disk, in a file without a name, for the head of the file names what is written last.
/// @throws what `require_registration_fits` throws, and Error when nothing can be written
std::unique_ptr<ImageWriter> create_registration(const std::filesystem::path& path, const Geometry& grid,
                                                 Registration registration);

}  // namespace tetwarp
