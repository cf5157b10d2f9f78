// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <utility>

#include "itkbridge/isolated/hdf5_limits.h"
#include "itkbridge/isolated/isolated_read.h"
#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

std::vector<TransformRecord> read_transform_hdf5(const std::filesystem::path& path, const std::stop_token& stop) {
  std::vector<TransformRecord> transforms;
  for (ReadRecord& record : read_isolated("transform-hdf5", path, 0, hdf5_limits(path), "HDF5", stop))
    transforms.push_back({std::move(record.name), std::move(record.head), std::move(record.values)});
  return transforms;
}

}  // namespace tetwarp
