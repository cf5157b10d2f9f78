# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# The choice of architectures for devices that this machine need not have.
cmake_minimum_required(VERSION 3.25)
include("${SOURCE}/cmake/TetwarpCudaArchitectures.cmake")
set(cuda_11 "sm_35\nsm_50\nsm_52\nsm_60\nsm_61\nsm_70\nsm_75\nsm_80\nsm_86\nsm_87\nsm_89\nsm_90\n")
set(cuda_13 "sm_75\nsm_80\nsm_86\nsm_87\nsm_88\nsm_89\nsm_90\nsm_100\nsm_110\nsm_103\nsm_120\nsm_121\n")
set(later "sm_80\nsm_90\nsm_100\nsm_120\nsm_130\n")

function(expect devices supported expected expected_reason)
  tetwarp_choose_cuda_architectures(chosen reason "${devices}" "${supported}")
  if(NOT chosen STREQUAL expected OR NOT reason MATCHES "^${expected_reason}")
    message(SEND_ERROR "devices \"${devices}\": found ${chosen} (${reason}), expected ${expected} (${expected_reason} ...)")
  endif()
endfunction()

set(any 75-virtual 80-real 90-real)
expect("90-real" "${cuda_13}" "90" "this machine's devices")
expect("90-real;90-real" "${cuda_13}" "90" "this machine's devices")
expect("120-real;90-real;86-real" "${cuda_13}" "86;90-real;120-real" "this machine's devices")  # by number, the oldest with PTX
expect("" "${cuda_13}" "${any}" "no device seen")
expect("" "${cuda_11}" "${any}" "no device seen")
expect("" "${later}" "80-virtual;90-real" "no device seen")
expect("70-real" "${cuda_13}" "${any}" "nvcc does not compile for this machine's devices, 70:")      # too old
expect("90-real;120-real" "${cuda_11}" "${any}" "nvcc does not compile for this machine's devices, 120:")  # too new: PTX
