// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/truth/subject.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/errors.h"

namespace tetwarp::truth {

Subject::Subject(simulate::Patient patient, Roles roles, const Geometry& volume)
    : patient_(std::move(patient)), roles_(std::move(roles)), volume_(volume) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell_size = std::llround(lattice().spacing[axis] / volume.spacing[axis]);
    last_inside_[axis] =
        std::min((volume.size[axis] - 1) / std::max<std::int64_t>(cell_size, 1), lattice().size[axis] - 1);
  }
  for (const auto& [role, labels] : roles_) {
    require(!patient_.vertex_label.empty(), "the role " + role + " needs a label map");
    const std::vector<std::uint8_t> marked = vertices(role);
    require(std::find(marked.begin(), marked.end(), 1) != marked.end(),
            "no vertex of the lattice has a label of the role " + role);
  }
}

std::vector<std::uint8_t> Subject::vertices(const std::string& role) const {
  const std::vector<std::int64_t>& wanted = roles_.at(role);
  std::vector<std::uint8_t> marked;
  marked.reserve(patient_.vertex_label.size());
  for (const std::int64_t label : patient_.vertex_label)
    marked.push_back(std::find(wanted.begin(), wanted.end(), label) != wanted.end());
  return marked;
}

std::vector<std::uint8_t> Subject::table() const {
  constexpr float kMatterHu = -900;
  const glm::i64vec3 size = lattice().size, cells = size - std::int64_t{1};
  // Of each vertex: whether a cell of the body, or of matter that is no body, meets there.
  std::vector<std::uint8_t> body(patient_.vertex_hu.size()), matter(body.size());
  std::size_t cell = 0;
  for (std::int64_t k = 0; k < cells.z; ++k) {
    for (std::int64_t j = 0; j < cells.y; ++j) {
      for (std::int64_t i = 0; i < cells.x; ++i, ++cell) {
        const bool is_body = patient_.body[cell] != 0;
        if (!is_body && patient_.cell_hu[cell] <= kMatterHu) continue;
        for (std::int64_t corner = 0; corner < 8; ++corner) {
          const std::int64_t at = i + (corner & 1) + size.x * (j + (corner >> 1 & 1) + size.y * (k + (corner >> 2)));
          (is_body ? body : matter)[static_cast<std::size_t>(at)] = 1;
        }
      }
    }
  }
  for (std::size_t n = 0; n < matter.size(); ++n) matter[n] = matter[n] && !body[n];
  return matter;
}

}  // namespace tetwarp::truth
