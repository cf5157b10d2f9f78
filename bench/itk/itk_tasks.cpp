// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk_tasks.h"

#include <algorithm>

#include "deform/errors.h"

namespace tetwarp::bench {

const std::vector<ItkTask>& itk_tasks() {
  static const std::vector<ItkTask> tasks{
      {kPull,
       "warp, the inverse field is given",
       "HU",
       {{"pull", "PullFieldResampleImageFilter", true},
        {"itk-resample", "ResampleImageFilter, DisplacementFieldTransform"},
        {"itk-warp", "WarpImageFilter"}}},
      {kForward,
       "warp, the forward field is given",
       "HU",
       {{"forward", "VertexFieldResampleImageFilter", true},
        {"itk-invert-warp", "InvertDisplacementFieldImageFilter, WarpImageFilter"}}},
      {kInvert,
       "invert a displacement field",
       "voxels",
       {{"invert", "ExactInvertDisplacementFieldImageFilter", true},
        {"itk-invert", "InvertDisplacementFieldImageFilter"},
        {"itk-invert-free", "InvertDisplacementFieldImageFilter, EnforceBoundaryConditionOff"}}},
      {kDeterminant,
       "Jacobian determinant",
       "",
       {{"determinant", "VertexFieldToJacobianDeterminantFilter", true},
        {"itk-determinant", "DisplacementFieldJacobianDeterminantFilter"}}},
      {kTransform,
       "sample a B-spline transform",
       "voxels",
       {{"transform", "TransformToVertexFieldFilter", true}, {"itk-transform", "TransformToDisplacementFieldFilter"}}},
      {kStream,
       "read, warp and write in pieces",
       "",
       {{"stream", "VertexFieldResampleImageFilter", true}, {"itk-stream", "WarpImageFilter"}}},
  };
  return tasks;
}

const ItkTask& itk_task(const std::string& key) {
  const auto& tasks = itk_tasks();
  const auto found = std::find_if(tasks.begin(), tasks.end(), [&](const ItkTask& task) { return task.key == key; });
  require(found != tasks.end(), "no task \"" + key + "\"");
  return *found;
}

}  // namespace tetwarp::bench
