// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

namespace tetwarp {

/// Version of the project, such as "0.1.0".
const char* version();

/// Commit from which this was built: twelve hexadecimal digits, followed by "-dirty" where the sources differed from
/// it. It is "unknown" for a build outside its own git repository.
const char* commit();

}  // namespace tetwarp
