// Which sources are near, for one instruction level: compiled once a level like pair_loops_level.cpp, but by the rules
// of IEEE arithmetic and without fused products. Symmetric bodies have many pairs whose distance is the reach itself;
// all levels decide them alike.
#include "sim/bem/pair_loops.h"

namespace touchfield::TOUCHFIELD_LEVEL {

int near_sources(const PairPoint<double>& point, const PairSources<double>& sources, const double* reach_squared,
                 int total, int* near) {
  const PairPoint<double> p = point;
  unsigned char inside[kPairBlock];
  int found = 0;
  for (int first = 0; first < total; first += kPairBlock) {
    const int count = total - first < kPairBlock ? total - first : kPairBlock;
    const double* x = sources.x + first;
    const double* y = sources.y + first;
    const double* z = sources.z + first;
    const double* reach = reach_squared + first;
    int any = 0;
#pragma omp simd reduction(+ : any)
    for (int j = 0; j < count; ++j) {
      const double dx = p.x - x[j];
      const double dy = p.y - y[j];
      const double dz = p.z - z[j];
      const int hit = dx * dx + dy * dy + dz * dz < reach[j] ? 1 : 0;
      inside[j] = static_cast<unsigned char>(hit);
      any += hit;
    }
    for (int j = 0; any > 0 && j < count; ++j) {
      near[found] = first + j;
      found += inside[j];
      any -= inside[j];
    }
  }
  return found;
}

}  // namespace touchfield::TOUCHFIELD_LEVEL
