// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: where multi-frame CT keeps the attributes of a slice.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctagkey.h>

#include <vector>

namespace tetwarp {

/// A macro of the Multi-frame Functional Groups Module (PS3.3 C.7.6.16.2, C.8.15.3), and which of its attributes the CT
/// Image IOD has, too.
struct FunctionalGroup {
  struct Renamed {
    DcmTagKey from, to;
  };
  DcmTagKey sequence;
  std::vector<DcmTagKey> attributes;  ///< attributes that have the same tag in both
  std::vector<Renamed> renamed = {};
};

/// The macros that tell where a frame lies, what its values mean and how it was made. References to other images are
/// not among them.
const std::vector<FunctionalGroup>& functional_groups();

}  // namespace tetwarp
