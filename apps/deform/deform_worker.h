// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "backend/backend.h"

namespace tetwarp::apps {

/// What computes: a backend by its choice, and the number of a device.
struct Worker {
  BackendChoice backend = BackendChoice::automatic;
  int device = 0;
  void* stream = nullptr;  ///< of the device, for all that is queued there; null: its default stream
};

}  // namespace tetwarp::apps
