#pragma once

#include <omp.h>

namespace touchfield {
inline namespace support {

/// What an action returns on so many threads.
template <class Action>
auto with_threads(int count, const Action& action) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(count);
  auto made = action();
  omp_set_num_threads(before);
  return made;
}

}  // namespace support
}  // namespace touchfield
