// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <stdexcept>
#include <string>

namespace tetwarp {

/// Root of everything that Tetwarp throws. The text is one line: WHAT, WHERE; WHAT TO DO, with expected and found
/// values.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The input (a file, a series, a field, a shape) cannot be used as asked. Nothing was changed.
class InputError : public Error {
 public:
  using Error::Error;
};

/// The accelerator failed: no device, out of memory, a failed call. Names the call, file and line.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// The accelerator has not the memory that is needed: in smaller pieces, or on the processor, it may go.
class DeviceMemoryError : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// The part that was asked for is not in this build.
class NotCompiled : public Error {
 public:
  using Error::Error;
};

/// `Control::stop` was requested; outputs hold no usable result.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

/// Throws InputError with `message` unless `condition` holds.
inline void require(bool condition, const std::string& message) {
  if (!condition) throw InputError(message);
}

}  // namespace tetwarp
