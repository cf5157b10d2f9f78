// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkProcessObject.h>

#include <functional>

#include "deform/resampler.h"

namespace tetwarp {

/// Part of a filter's progress that a piece of its work is. `begin == end`: it tells nothing.
struct ProgressShare {
  float begin = 0, end = 1;
};

/// Does work for a filter of ITK with the manners of one. The work runs in a thread of its own; the thread that called
/// waits, tells the filter's observers of the progress (never backwards), and looks every 5 ms whether
/// AbortGenerateData was set, by an observer or another thread. So observers are called by the thread that called
/// Update, as they are by ITK's own filters.
/// @throws itk::ProcessAborted when aborted; itk::ExceptionObject with the text of a tetwarp::Error; what an observer
///         throws, after the work has ended
void run_for(itk::ProcessObject& filter, ProgressShare share, const std::function<void(const Control&)>& work);

/// A warning as itkWarningMacro gives it.
void warn(const itk::ProcessObject& filter, const std::string& text);

/// Rethrows a tetwarp::Error that `work` throws as an itk::ExceptionObject of the filter.
void translate_errors(const itk::ProcessObject& filter, const std::function<void()>& work);

/// What a filter's settings allow: its work units, and no more threads than its multi-threader has.
int threads_of(const itk::ProcessObject& filter);

}  // namespace tetwarp
