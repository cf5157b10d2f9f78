// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/hdf5_list.h"

#include <algorithm>

#include "deform/errors.h"
#include "itkbridge/isolated/hdf5_limits.h"

namespace tetwarp {
namespace {

bool is_of(const H5::DataType& type, Hdf5Numbers numbers) {
  using Type = H5::PredType;
  if (numbers == Hdf5Numbers::whole) return type.getClass() == H5T_INTEGER && type.getSize() <= sizeof(std::int64_t);
  return type == Type::IEEE_F64LE || type == Type::IEEE_F32LE || type == Type::IEEE_F64BE || type == Type::IEEE_F32BE;
}

/// Number of values in a chunk, for which HDF5 allocates memory however few of them are read; 0: there are no chunks.
hsize_t chunk_of(const H5::DataSet& set) {
  const H5::DSetCreatPropList layout = set.getCreatePlist();
  hsize_t chunk = 0;
  if (layout.getLayout() == H5D_CHUNKED) layout.getChunk(1, &chunk);
  return chunk;
}

}  // namespace

std::vector<double> hdf5_list(const H5::DataSet& set, Hdf5Numbers numbers, const std::string& name,
                              const Hdf5Source& source) {
  const H5::DataSpace space = set.getSpace();
  require(is_of(set.getDataType(), numbers) && space.isSimple() && space.getSimpleExtentNdims() == 1,
          name + " is not a list of " + (numbers == Hdf5Numbers::real ? "floats or doubles, " : "whole numbers, ") +
              source.file);
  hsize_t count = 0;
  space.getSimpleExtentDims(&count);
  const auto stored = static_cast<double>(set.getStorageSize());
  const double needed =
      static_cast<double>(std::max(count, chunk_of(set))) * static_cast<double>(set.getDataType().getSize());
  require(stored <= source.bytes && needed <= stored * static_cast<double>(kDeflateAtMost),
          "truncated, or a header that promises too much, " + source.file + ": " + name + " has " +
              std::to_string(count) + " values");
  std::vector<double> values(count);
  if (count > 0) set.read(values.data(), H5::PredType::NATIVE_DOUBLE);
  return values;
}

}  // namespace tetwarp
