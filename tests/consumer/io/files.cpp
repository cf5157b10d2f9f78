// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Writes a volume and reads it back; reads a transform, for which tetwarp::io loads a module, and one of HDF5, for
// which the module starts tetwarp-read.
#include <algorithm>
#include <cstdio>
#include <fstream>

#include "io/image_file.h"
#include "io/transform_file.h"

int main(int, char** arguments) {
  using namespace tetwarp;
  const std::filesystem::path folder = arguments[1];
  const Geometry grid{.size = {3, 2, 2}};
  const Volume<std::int16_t> volume{grid, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}};
  int wrong = 0;
  for (const char* name : {"volume.nrrd", "volume.nii.gz"}) {
    write_image(folder / name, view(volume));
    const AnyVolume read = read_image(folder / name);
    if (std::ranges::equal(volume.voxels, read.as<std::int16_t>())) continue;
    std::printf("%s reads back other voxels\n", name);
    ++wrong;
  }

  std::ofstream(folder / "shift.tfm") << "#Insight Transform File V1.0\nTransform: TranslationTransform_double_3_3\n"
                                         "Parameters: 1 2 3\nFixedParameters:\n";
  const glm::dvec3 shift = read_transform_file(folder / "shift.tfm").displacement({5, 5, 5});
  std::printf("a transform shifts by %g %g %g, expected 1 2 3\n", shift.x, shift.y, shift.z);
  const TransformFile hdf5 = read_transform_file(arguments[2]);
  std::printf("HDF5 has %zu transforms, expected 2\n", hdf5.classes.size());
  return wrong == 0 && shift == glm::dvec3{1, 2, 3} && hdf5.classes.size() == 2 ? 0 : 1;
}
