// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkProcessObject.h>

#include <functional>

#include "deform/resampler.h"

namespace tetwarp {

/// The part of a filter's progress that a piece of its work makes up. If `begin` equals `end`, no progress is told.
struct ProgressShare {
  float begin = 0,  ///< progress when the work begins, 0 to 1
      end = 1;      ///< progress when it is done
};

/// Does work for a filter of ITK as users of ITK expect it. The work runs in a thread of its own. The calling thread
/// waits, tells the filter's observers of progress, which never falls, and looks every 5 ms whether AbortGenerateData
/// was set. So observers are called by the thread that called Update, as by ITK's own filters.
/// @param filter  the filter
/// @param share   its part of the filter's progress
/// @param work    gets progress and stop, and may throw
/// @throws itk::ProcessAborted when aborted
/// @throws itk::ExceptionObject with the text of a tetwarp::Error; and whatever an observer throws, after the work has
///         ended
void run_for(itk::ProcessObject& filter, ProgressShare share, const std::function<void(const Control&)>& work);

/// Issues a warning like itkWarningMacro.
void warn(const itk::ProcessObject& filter, const std::string& text);

/// Does work. A tetwarp::Error that it throws becomes an itk::ExceptionObject of the filter.
void translate_errors(const itk::ProcessObject& filter, const std::function<void()>& work);

/// Number of threads that a filter may use: its work units, but no more threads than its multi-threader has.
int threads_of(const itk::ProcessObject& filter);

}  // namespace tetwarp
