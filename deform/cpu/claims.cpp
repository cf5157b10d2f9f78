// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/claims.h"

namespace tetwarp::cpu {

void Claims::find(const LatticeIndex& lattice, const Region& box, bool wants_jacobian, bool wants_owners,
                  LatticeBlock& block) {
  const auto voxel_number = static_cast<std::size_t>(voxel_count(box));
  owner.assign(voxel_number, kNobody);
  offset.resize(voxel_number);
  if (wants_jacobian) jacobian.resize(voxel_number);
  if (wants_owners) owners.assign(voxel_number, 0);
  const glm::i64vec3 size = box.end - box.begin;
  const glm::i64vec3& cells = lattice.cells();
  const auto claim_cell = [&](const glm::i32vec3& in_block) {
    const glm::i64vec3 at = block.first_cell + glm::i64vec3(in_block);
    const std::uint64_t first =
        kTetrahedraPerCell * static_cast<std::uint64_t>((at.z * cells.y + at.y) * cells.x + at.x);
    visit_cell(block.cell(in_block), block.is_odd(in_block), {box.begin, box.end}, lattice.frame().nudge,
               [&](const glm::i64vec3& voxel, const glm::i32vec3& signs, int t, const Tetrahedron& tetrahedron) {
                 const glm::i64vec3 in = voxel - box.begin;
                 const auto place = static_cast<std::size_t>((in.z * size.y + in.y) * size.x + in.x);
                 if (wants_owners && owners[place] != UINT16_MAX) ++owners[place];
                 const std::uint64_t number = first + static_cast<std::uint64_t>(t);
                 if (number >= owner[place]) return;
                 owner[place] = number;
                 offset[place] = interpolate_u(tetrahedron, detail::to_steps(voxel), signs);
                 if (wants_jacobian) jacobian[place] = forward_jacobian(tetrahedron);
               });
  };
  lattice.find_blocks(box, [&](std::size_t number) {
    lattice.load(number, block);
    for (int z = 0; z < block.cells.z; ++z) {
      for (int y = 0; y < block.cells.y; ++y) {
        for (int x = 0; x < block.cells.x; ++x) claim_cell({x, y, z});
      }
    }
  });
}

}  // namespace tetwarp::cpu
