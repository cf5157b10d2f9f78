// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <sstream>

#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "deform/geometry.h"
#include "deform/phantom.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

constexpr std::int64_t kMostVoxels = 4096;

void check(const PhantomOptions& options) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (options.size[axis] < 2 || options.size[axis] > kMostVoxels) {
      throw UsageError("--size has " + std::to_string(options.size[axis]) + ", expected 2 to 4096 on every axis");
    }
    if (!is_spacing(options.spacing[axis])) {
      std::ostringstream found;
      found << options.spacing[axis];
      throw UsageError("--spacing has " + found.str() + ", expected millimetres from 1e-6 to 1e6");
    }
  }
}

}  // namespace

int run_phantom(const PhantomOptions& options) {
  check(options);
  const bool series = is_series_output(options.output);
  if (!options.labels.empty() && is_series_output(options.labels))
    throw UsageError("--labels " + options.labels.string() + " is no volume file; expected .nii .nii.gz .nrrd or .mha");
  OutputSet outputs(Reads(), options.common.overwrite);
  const std::filesystem::path output =
      outputs.add(options.output, series ? StagedOutput::Kind::folder : StagedOutput::Kind::file);
  const std::filesystem::path labels = outputs.add(options.labels);
  const glm::i64vec3 size(options.size[0], options.size[1], options.size[2]);
  const glm::dvec3 spacing(options.spacing[0], options.spacing[1], options.spacing[2]);
  const PhantomLook look{.noise_hu = options.noise_hu};
  const LabelledPhantom phantom = [&] {
    Stage stage(options.common, "phantom");
    if (labels.empty()) return LabelledPhantom{make_phantom(size, spacing, options.seed, look), {}};
    return make_labelled_phantom(size, spacing, options.seed, look);
  }();
  Stage stage(options.common, "write");
  outputs.write([&] {
    if (series) {
      write_phantom_series(output, view(phantom.ct), options.seed, stage.control());
    } else {
      write_image(output, view(phantom.ct));
    }
    if (!labels.empty()) write_image(labels, view(phantom.labels));
  });
  outputs.commit();
  say(options.common, "wrote " + options.output.string() + ": " + to_string(size) + " voxels");
  return 0;
}

}  // namespace tetwarp::apps
