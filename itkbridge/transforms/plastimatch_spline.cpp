// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transforms/plastimatch_spline.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <string_view>

#include "deform/errors.h"

namespace tetwarp {
namespace {

using Header = std::map<std::string, std::vector<double>, std::less<>>;

/// The values of a key: a reference into `header`. The key is passed by value, for GCC 14 would suspect that a
/// reference to a temporary key is what is returned.
const std::vector<double>& field(const Header& header, std::string_view key, std::size_t count,
                                 const std::string& file) {
  const auto found = header.find(key);
  require(found != header.end(), "no " + std::string(key) + " in " + file + "; the file may be truncated");
  require(found->second.size() == count, std::to_string(found->second.size()) + " values of " + std::string(key) +
                                             " in " + file + "; expected " + std::to_string(count));
  return found->second;
}

/// Size, origin, spacing and direction of the grid of coefficients, in the order of ITK's BSplineTransform.
std::vector<double> grid_of(const Header& header, const std::string& file) {
  const auto& origin = field(header, "img_origin", 3, file);
  const auto& spacing = field(header, "img_spacing", 3, file);
  const auto& offset = field(header, "roi_offset", 3, file);
  const auto& voxels = field(header, "roi_dim", 3, file);
  const auto& region = field(header, "vox_per_rgn", 3, file);
  const auto& direction = field(header, "direction_cosines", 9, file);
  std::vector<double> size(3), first(origin), step(3);
  // plastimatch keeps the origin as float and prints six decimals. With this slack the first voxels do not fall out of
  // the domain.
  double slack = 1e-6;
  for (const double value : origin) slack = std::max(slack, 1e-6 + 6e-8 * std::abs(value));
  // Cosines have six decimals too, which an oblique grid feels the farther the voxels are from its origin.
  const bool oblique = std::ranges::any_of(direction, [](double cosine) { return cosine != std::round(cosine); });
  for (std::size_t axis = 0; axis < 3 && oblique; ++axis) slack += 5e-7 * voxels[axis] * spacing[axis];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    require(region[axis] >= 1, "vox_per_rgn " + std::to_string(region[axis]) + " in " + file + "; expected at least 1");
    size[axis] = std::ceil(voxels[axis] / region[axis]) + 3;
    step[axis] = region[axis] * spacing[axis];
    for (std::size_t row = 0; row < 3; ++row)
      first[row] += direction[3 * row + axis] * (offset[axis] * spacing[axis] - step[axis] - slack);
  }
  std::vector<double> grid = size;
  for (const std::vector<double>& part : {first, step, direction}) grid.insert(grid.end(), part.begin(), part.end());
  return grid;
}

}  // namespace

TransformRecord read_plastimatch_spline(const std::filesystem::path& path) {
  const std::string file = path.string();
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  std::getline(stream, line);  // skips the magic
  Header header;
  TransformRecord record{"BSplineTransform_double_3_3", {}, {}};
  for (std::int64_t number = 2; std::getline(stream, line); ++number) {
    const std::string where = "line " + std::to_string(number) + " of " + file;
    if (const auto equals = line.find('='); equals != std::string::npos) {
      const std::string key = line.substr(0, line.find_first_of(" \t="));
      header[key] = parse_numbers(std::string_view(line).substr(equals + 1), key + " in " + where);
      continue;
    }
    for (const double value : parse_numbers(line, where)) record.parameters.push_back(value);
  }
  record.fixed = grid_of(header, file);
  return record;
}

}  // namespace tetwarp
