// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "tests/support/program.h"

/// Whether the program reads files of transforms, for tests of these: a build without ITK does not.
/// @param folder  in which a file is written and removed
inline bool program_reads_transforms(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "transform.tfm";
  std::ofstream(file) << "#Insight Transform File V1.0\n#Transform 0\nTransform: TranslationTransform_double_3_3\n"
                         "Parameters: 0 0 0\nFixedParameters:\n";
  const Outcome said = run_tetwarp(folder, "info transform.tfm");
  std::filesystem::remove(file);
  return said.err.find("need ITK") == std::string::npos;
}
