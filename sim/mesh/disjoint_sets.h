#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

namespace touchfield {

/// Disjoint sets of the numbers 0 .. count - 1, joined one by one.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  /// One number that stands for the set of i until sets are joined.
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) {
      i = parent_[i] = parent_[parent_[i]];
    }
    return i;
  }

  void join(std::size_t i, std::size_t j) { parent_[root(i)] = root(j); }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace touchfield
