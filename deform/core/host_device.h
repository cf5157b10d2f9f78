// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The one header of deform/ that knows of a compiler for devices, nvcc. All others write TETWARP_HD, and
// TETWARP_ON_DEVICE where a device has an instruction of its own.
//
// It is also the one place that includes GLM: GLM 0.9.9.8 wants <cuda.h> first under nvcc, and GLM_FORCE_CUDA (a
// definition of the target, the same for every file) makes its functions callable on the device.
#if defined(__CUDACC__)
#include <cuda.h>
// Marks a function that runs on the host and on the device.
#define TETWARP_HD __host__ __device__
// Marks such a function that is always inlined.
#define TETWARP_INLINE_HD __forceinline__ __host__ __device__
// Marks such a function that is never inlined.
#define TETWARP_NOINLINE_HD __noinline__ __host__ __device__
#else
#define TETWARP_HD
#define TETWARP_INLINE_HD [[gnu::always_inline]] inline
#define TETWARP_NOINLINE_HD [[gnu::noinline]]
#endif

// Defined while code for the device is made, of functions that run on both.
#if defined(__CUDA_ARCH__)
#define TETWARP_ON_DEVICE
#endif

#include <glm/ext/vector_int3_sized.hpp>
#include <glm/ext/vector_uint4_sized.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
