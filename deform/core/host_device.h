// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The one place that includes GLM: GLM 0.9.9.8 wants <cuda.h> first under nvcc, and GLM_FORCE_CUDA (a definition of the
// target, the same for every file) makes its functions callable on the device.
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

#include <glm/ext/vector_int3_sized.hpp>
#include <glm/ext/vector_uint4_sized.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
