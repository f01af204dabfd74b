#pragma once

#include <cstdint>

#include "sim/gpu/cuda/context.cuh"

// Lists on the card, sorted by what they belong to.

namespace touchfield::cuda {

/// Sorts keys below `most` (> 0), and what goes with them, keeping the order of equal ones.
template <typename Key>
void sort_pairs(Context& context, Key most, const Array<Key>& key, const Array<int>& value, Array<Key>& sorted,
                Array<int>& moved);

/// The first of each number 0 .. count in sorted ones.
void find_starts(Context& context, const Array<int>& sorted, int count, Array<int>& start);

/// Begins of lists whose lengths are given, with a 0 at the end; returns how long they are together.
int add_up(Context& context, const Array<int>& count, Array<int>& start);

}  // namespace touchfield::cuda
