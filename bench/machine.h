#pragma once

#include "bench/results.h"

namespace tetwarp::bench {

/// @param device  of CUDA; -1: none is used. @param threads  0: all
Machine describe_machine(int device, int threads);

}  // namespace tetwarp::bench
