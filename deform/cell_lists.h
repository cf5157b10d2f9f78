// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tetwarp {

/// For each of many cells, the numbers of the items (such as tetrahedra) that may reach it. The lists lie one after
/// another in one array.
class CellLists {
 public:
  /// Makes the lists.
  /// @param cells          number of cells
  /// @param for_each_pair  called twice: `for_each_pair(visit)` calls `visit(cell, number)` for every item that may
  /// reach a cell, both times in the same order, which is that of each list
  template <class ForEachPair>
  void build(std::size_t cells, ForEachPair&& for_each_pair) {
    first_.assign(cells + 1, 0);
    for_each_pair([&](std::size_t cell, std::size_t) { ++first_[cell + 1]; });
    for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
    numbers_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each_pair(
        [&](std::size_t cell, std::size_t number) { numbers_[next[cell]++] = static_cast<std::uint32_t>(number); });
  }

  const std::uint32_t* begin(std::size_t cell) const { return numbers_.data() + first_[cell]; }
  const std::uint32_t* end(std::size_t cell) const { return numbers_.data() + first_[cell + 1]; }

 private:
  std::vector<std::size_t> first_;  ///< by cell: where its list begins; and one entry more
  std::vector<std::uint32_t> numbers_;
};

}  // namespace tetwarp
