# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# tetwarp_enable_cuda(): enables CUDA and chooses the architectures for which device code is compiled. Their number makes
# most of the time that CUDA adds to a build. CMAKE_CUDA_ARCHITECTURES (in the environment: CUDAARCHS) decides where it is given,
# next TETWARP_CUDA_ARCHITECTURES, otherwise this machine. One line of output states the choice.
macro(tetwarp_enable_cuda)
  if(TETWARP_CUDA_ARCHITECTURES AND NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
    set(CMAKE_CUDA_ARCHITECTURES "${TETWARP_CUDA_ARCHITECTURES}")
  endif()
  if(DEFINED CMAKE_CUDA_ARCHITECTURES OR DEFINED ENV{CUDAARCHS})
    set(tetwarp_cuda_reason "as given")
    enable_language(CUDA)
  else()
    set(CMAKE_CUDA_ARCHITECTURES OFF)  # until the compiler is known
    enable_language(CUDA)
    # CMake looks for devices when it meets the compiler, and keeps what it found with the build: a device that comes or
    # goes later does not compile everything anew.
    execute_process(COMMAND "${CMAKE_CUDA_COMPILER}" --list-gpu-code OUTPUT_VARIABLE tetwarp_cuda_supported ERROR_QUIET)
    tetwarp_choose_cuda_architectures(CMAKE_CUDA_ARCHITECTURES tetwarp_cuda_reason
                                      "${CMAKE_CUDA_ARCHITECTURES_NATIVE}" "${tetwarp_cuda_supported}")
  endif()
  # CMake 3.25 (Debian 12) sets a property of a target that it makes of this library, although CUDA 13 has no such library.
  if(NOT TARGET CUDA::nvToolsExt)
    add_library(CUDA::nvToolsExt INTERFACE IMPORTED)
  endif()
  set(TETWARP_CUDA_COMPILED_FOR "${CMAKE_CUDA_ARCHITECTURES}" CACHE INTERNAL "CUDA architectures of this build")
  message(STATUS "Tetwarp: CUDA architectures ${CMAKE_CUDA_ARCHITECTURES} (${tetwarp_cuda_reason})")
endmacro()

# tetwarp_choose_cuda_architectures(CHOSEN REASON DEVICES SUPPORTED): sets CHOSEN to the architectures to compile for, and
# REASON to why, in words.
# DEVICES: architectures of this machine's devices, as 90 or 90-real; empty where there is none. SUPPORTED: what
# `nvcc --list-gpu-code` prints.
#
# Where nvcc knows all devices that are seen, it compiles for them alone. The oldest one's PTX comes along, which costs
# nothing, so that the program also runs on other cards that are not older.
#
# Otherwise the program may go anywhere. NVIDIA's driver compiles PTX for a card when a program first runs on it, and
# keeps the result; the bits are the same, but the first run waits for it. So machine code is made for the cards that most
# servers and workstations have, 8.0 (A100; it also runs on 8.6 to 8.9: RTX 30 and 40, L4, L40) and 9.0 (H100, H200), and
# PTX of 7.5 serves all others, from T4 and RTX 20 to those that are newer than nvcc. PTX of 9.0 would leave 7.5 out and
# be no better for newer cards, for no code asks for an architecture. Later versions of nvcc that know 7.5 no more begin
# with 8.0. `all-major` of CUDA 13 is six architectures of machine code, and takes twice the time.
function(tetwarp_choose_cuda_architectures chosen_out reason_out devices supported)
  string(REGEX MATCHALL "sm_[0-9]+" supported "${supported}")
  list(TRANSFORM supported REPLACE "sm_" "")
  list(TRANSFORM devices REPLACE "-real$" "")
  list(REMOVE_DUPLICATES devices)
  list(SORT devices COMPARE NATURAL)
  set(unknown ${devices})
  list(REMOVE_ITEM unknown ${supported})
  if(devices AND NOT unknown)
    list(POP_FRONT devices oldest)
    list(TRANSFORM devices APPEND "-real")
    set(chosen ${oldest} ${devices})
    set(reason "this machine's devices")
  else()
    set(chosen "")
    foreach(architecture 75 80 90)
      if(architecture IN_LIST supported)
        list(APPEND chosen ${architecture}-real)
      endif()
    endforeach()
    list(TRANSFORM chosen REPLACE "-real$" "-virtual" AT 0)
    if(devices)
      set(reason "nvcc does not compile for this machine's devices, ${unknown}: code for any device")
    else()
      set(reason "no device seen: code for any device")
    endif()
  endif()
  set(${chosen_out} "${chosen}" PARENT_SCOPE)
  set(${reason_out} "${reason}" PARENT_SCOPE)
endfunction()
