// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace tetwarp::cuda_detail {

/// Device memory that one slab of the output needs, bytes.
struct SlabNeeds {
  std::uint64_t field = 0;   ///< for the part of the lattice that reaches the slab
  std::uint64_t source = 0;  ///< for the slices of all sources from which the slab may be sampled
  std::uint64_t output = 0;  ///< for results that wait to be copied to the host

  std::uint64_t total() const { return field + source + output; }
};

/// The larger number of each pair.
SlabNeeds larger(const SlabNeeds& a, const SlabNeeds& b);

/// A division of the output into slabs along k.
struct SlabPlan {
  std::int64_t slices = 0;  ///< slices of a slab, the last of which may have fewer; 0: not even single slices fit
  SlabNeeds needs;          ///< the largest of each need over all slabs, which is the size of buffers
};

/// The highest slabs that fit one by one: all slices, or half of them, or a quarter, and so on.
/// @param needs_of  what the slab begin <= k < end needs
SlabPlan plan_slabs(std::int64_t begin, std::int64_t end, std::uint64_t allowed,
                    const std::function<SlabNeeds(std::int64_t begin, std::int64_t end)>& needs_of);

/// @param held  what is held of the field: "part of the field", "whole field"
/// @throws DeviceError, always; it names what one slice of the output needs and what is allowed
[[noreturn]] void refuse_slab(const SlabNeeds& needs, const std::string& held, std::uint64_t allowed);

/// @throws DeviceError, always, for a field that cannot be held in parts
[[noreturn]] void refuse_field(std::uint64_t bytes, std::uint64_t allowed);

/// Number of slices of cells in a piece of a lattice that is looked at on its own: an even number, or all.
///
/// @param slice_bytes  bytes of a slice of vertices on the device
/// @param held         bytes that are held for the field already. They are reused, so that repeated fields allocate
///         nothing.
/// @throws DeviceError where the smallest piece does not fit
std::int64_t cells_of_piece(std::int64_t cells, std::uint64_t slice_bytes, std::uint64_t held, std::uint64_t allowed);

}  // namespace tetwarp::cuda_detail
