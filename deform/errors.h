// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <concepts>
#include <stdexcept>
#include <string>

namespace tetwarp {

/// Root of everything that Tetwarp throws. The text is one line, "WHAT, WHERE; WHAT TO DO", and states the values that
/// were expected and found.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// An input (a file, a series, a field, the shape of an array) cannot be used. Nothing was changed.
class InputError : public Error {
 public:
  using Error::Error;
};

/// A device failed: there is none, its memory is full, or a call returned an error. The text names the call, the
/// file and the line.
class DeviceError : public Error {
 public:
  using Error::Error;
};

/// A device has too little free memory for the work. Smaller regions, or the CPU, may still do it.
class DeviceMemoryError : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

/// This build does not contain the part of Tetwarp that was called, such as a backend, ITK or DCMTK.
class NotCompiled : public Error {
 public:
  using Error::Error;
};

/// A stop was requested through `Control::stop`. The outputs hold no usable result.
class Cancelled : public Error {
 public:
  /// The text is always "cancelled".
  Cancelled() : Error("cancelled") {}
};

/// Throws InputError with `message` unless `condition` holds.
inline void require(bool condition, const std::string& message) {
  if (!condition) throw InputError(message);
}

/// The same for checks of every call: the message is what `make_message` returns, and is made only to be thrown.
template <std::invocable MakeMessage>
void require(bool condition, MakeMessage&& make_message) {
  if (!condition) throw InputError(make_message());
}

}  // namespace tetwarp
