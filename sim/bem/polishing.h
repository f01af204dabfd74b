#pragma once

#include "sim/bem/boundary_operator.h"

namespace touchfield {

inline constexpr int kPolishingSteps = 2;  // a third lets what resonates grow back

/// B_c of paper_corrected, by whose products burton_miller_polished polishes: p += e - B_c p.
///
/// diagonal   gauss_diagonal()
inline BoundaryParts polishing_parts(Eigen::VectorXcd diagonal) {
  return {Layer::kDouble, 0.0, std::move(diagonal), nullptr};
}

}  // namespace touchfield
