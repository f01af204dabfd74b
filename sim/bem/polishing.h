#pragma once

#include "sim/bem/boundary_operator.h"

namespace touchfield {

inline constexpr int kPolishingSteps = 2;  // a third lets what resonates grow back

/// B_c of paper_corrected, by whose products burton_miller_polished polishes: p += e - B_c p.
inline BoundaryParts polishing_parts(const TriangleMesh& mesh) {
  return {Layer::kDouble, 0.0, gauss_diagonal(mesh).cast<Complex>(), nullptr};
}

}  // namespace touchfield
