// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>

#include "bench/itk/itk_process.h"

namespace tetwarp::bench {

/// One filter, or several one behind the other, with their inputs in memory.
class ItkWork {
 public:
  virtual ~ItkWork() = default;

  /// Update(), once.
  virtual void run() = 0;
  /// Pixels of the inputs, of the output after `run`.
  virtual std::uint64_t input_bytes() const = 0;
  virtual std::uint64_t output_bytes() const = 0;
  /// The output against the truth; none where there is none.
  virtual std::optional<Deviation> deviation() const = 0;
};

/// Reads what the request needs. @throws Error with ITK's words; InputError for a method that there is not
std::unique_ptr<ItkWork> make_itk_work(const ItkRequest& request, const ItkFiles& files);

// The two halves of it: images through fields, and fields alone. Null for the other's methods.
std::unique_ptr<ItkWork> make_itk_image_work(const ItkRequest& request, const ItkFiles& files);
std::unique_ptr<ItkWork> make_itk_field_work(const ItkRequest& request, const ItkFiles& files);

}  // namespace tetwarp::bench
