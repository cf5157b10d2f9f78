// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>

#include "bench/itk/itk_results.h"

namespace tetwarp::bench {

/// Writes a phantom and fields into `folder`, which exists and is empty, and measures what the options ask for, each
/// measurement by this program run again (`itk_process.h`).
///
/// @param say  is told of every run, one line
/// @throws Error, InputError
ItkResults measure_itk(const ItkOptions& options, const std::filesystem::path& folder,
                       const std::function<void(const std::string&)>& say);

}  // namespace tetwarp::bench
