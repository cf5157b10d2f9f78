// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Gathers of AVX2 with each of the sixteen registers as the index. The SIB byte of a general address takes index 4 for
// "no index"; that of a gather does not, for its index is a vector. qemu-x86_64 7.2 takes it so all the same where the
// register is xmm4, ymm4 (and not xmm12): then every element is read from the base. qemu-x86_64 10.0 and processors
// print sixteen times "right".
//
//   g++ -O1 -static gather_index.cpp -o gather_index && ./gather_index
//   qemu-x86_64-static -cpu Haswell ./gather_index
#include <cstdio>

namespace {

constexpr int kTable[8] = {100, 101, 102, 103, 104, 105, 106, 107};
constexpr int kIndices[8] = {7, 6, 5, 4, 3, 2, 1, 0};

// What a gather of 32-bit elements gives with register NUMBER as the index.
#define TETWARP_GATHER(NUMBER, RESULT, MASK)                                         \
  void gather_##NUMBER(int* gathered) {                                              \
    asm volatile("vmovdqu (%1), %%ymm" #NUMBER                                       \
                 "\n\t"                                                              \
                 "vpcmpeqd %%ymm" #MASK ", %%ymm" #MASK ", %%ymm" #MASK              \
                 "\n\t"                                                              \
                 "vpgatherdd %%ymm" #MASK ", (%2,%%ymm" #NUMBER ",4), %%ymm" #RESULT \
                 "\n\t"                                                              \
                 "vmovdqu %%ymm" #RESULT ", (%0)"                                    \
                 :                                                                   \
                 : "r"(gathered), "r"(kIndices), "r"(kTable)                         \
                 : "memory", "xmm" #NUMBER, "xmm" #RESULT, "xmm" #MASK);             \
  }

TETWARP_GATHER(0, 2, 3)
TETWARP_GATHER(1, 2, 3)
TETWARP_GATHER(2, 1, 3)
TETWARP_GATHER(3, 1, 2)
TETWARP_GATHER(4, 1, 2)
TETWARP_GATHER(5, 1, 2)
TETWARP_GATHER(6, 1, 2)
TETWARP_GATHER(7, 1, 2)
TETWARP_GATHER(8, 1, 2)
TETWARP_GATHER(9, 1, 2)
TETWARP_GATHER(10, 1, 2)
TETWARP_GATHER(11, 1, 2)
TETWARP_GATHER(12, 1, 2)
TETWARP_GATHER(13, 1, 2)
TETWARP_GATHER(14, 1, 2)
TETWARP_GATHER(15, 1, 2)

}  // namespace

int main() {
  void (*const gathers[16])(int*) = {gather_0,  gather_1,  gather_2,  gather_3, gather_4,  gather_5,
                                     gather_6,  gather_7,  gather_8,  gather_9, gather_10, gather_11,
                                     gather_12, gather_13, gather_14, gather_15};
  int wrong = 0;
  for (int number = 0; number < 16; ++number) {
    int gathered[8] = {};
    gathers[number](gathered);
    bool right = true;
    for (int element = 0; element < 8; ++element) {
      right = right && gathered[element] == kTable[kIndices[element]];
    }
    std::printf("index in ymm%d: %s\n", number, right ? "right" : "wrong");
    wrong += right ? 0 : 1;
  }
  return wrong;
}
