// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The program tetwarp-read. It reads a file, by a library that damaged files can bring down, for the process that
// starts it (itkbridge/isolated/isolated_read.h).
#include "itkbridge/isolated/read_child.h"
#include "itkbridge/meshes/med_reader.h"
#include "itkbridge/transforms/hdf5_reader.h"

int main(int argc, char** argv) {
  constexpr tetwarp::ChildReader kReaders[] = {{"transform-hdf5", tetwarp::read_hdf5_unconfined},
                                               {"mesh-med", tetwarp::read_med_unconfined}};
  return tetwarp::answer_read(argc, argv, kReaders);
}
