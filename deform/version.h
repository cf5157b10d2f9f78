// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

namespace tetwarp {

/// Version of the project, "0.1.0".
const char* version();

/// Commit that this was built from: twelve hexadecimal digits, "-dirty" after them where the sources differ from it;
/// "unknown" when built outside its own git repository.
const char* commit();

}  // namespace tetwarp
