// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "deform/volume.h"

namespace tetwarp {

/// What a voxel of the phantom belongs to: the values of its label map.
enum class PhantomLabel : std::uint8_t {
  nothing,     ///< air around the body, and the table
  body,        ///< skin, fat, muscle, cartilage and all else
  lung,        ///< lungs with their vessels
  bone,        ///< ribs, spine, sternum, shoulders
  heart,       ///< heart with its fat and chambers
  vessel,      ///< great vessels
  airway,      ///< trachea and bronchi: wall and air
  oesophagus,  ///< oesophagus
  liver,       ///< liver with its vessels
  spleen,      ///< spleen
  kidney,      ///< kidneys without their fat
  stomach,     ///< stomach with what is in it
  bowel,       ///< small bowel, duodenum and colon
  cord         ///< spinal canal
};
/// Names of the labels: that of label n is the n-th, beginning with "nothing".
std::span<const std::string_view> phantom_label_names();

/// How a phantom is made, beside its grid and its seed.
struct PhantomLook {
  double noise_hu = 12;  ///< standard deviation of the noise, HU; 0: none
};

/// A plausible CT of a trunk that never was: skin, fat, muscle, lungs with vessels, heart, liver, spine, ribs, table
/// and noise, in HU from -1024 to about 1300.
/// The volume depends on the arguments alone, and has the same bits on every machine.
///
/// @param size     voxels along i, j, k, each at least 2
/// @param spacing  mm along i, j, k. The body scales with the field of view; the grid is axial, its directions are L,
///         P, S and its middle is the origin.
/// @param seed     decides the noise and small variations of the anatomy
/// @param look     its noise
/// @throws InputError for a size, spacing or noise out of range
Volume<std::int16_t> make_phantom(const glm::i64vec3& size, const glm::dvec3& spacing, std::uint64_t seed,
                                  const PhantomLook& look = {});

/// A phantom and its labels, on the same grid.
struct LabelledPhantom {
  Volume<std::int16_t> ct;      ///< HU
  Volume<std::uint8_t> labels;  ///< of each voxel the `PhantomLabel` that fills at least half of it, painted last
};
/// As `make_phantom`, with the label of each voxel.
LabelledPhantom make_labelled_phantom(const glm::i64vec3& size, const glm::dvec3& spacing, std::uint64_t seed,
                                      const PhantomLook& look = {});

}  // namespace tetwarp
