#pragma once

#include <string>

#include "sim/rendering/skin_reduction.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

/// What the channels make of the skin, reduced for the phase methods, and how it was had.
struct Transfer {
  SkinReduction reduction;
  bool by_reciprocity = false;   // K rows by transposed solves; else r drives that span all channels, forwards
  Eigen::Index solves = 0;       // right-hand sides that were solved for
  double channels_left_out = 0;  // share, by norm, of b of all channels that the drives leave out
};

/// Solves for H in the cheaper way:
///
///   forwards       b of all channels is compressed to r drives V, P = pressures of V, H = P V^H: all of H, r solves
///   by reciprocity rows of H at the target alone, K solves with B^T; no quiet rows
///
/// quiet_weight   w_Z; at 0 the quiet skin is not needed, and the way with fewer solves is taken
/// accuracy       V leaves out 1e-5 of b, the quiet rows eigenvalues below 1e-8 of the largest
Transfer make_transfer(SkinScattering& scattering, const Target& target, double quiet_weight);

/// One line: the way, solves, ranks and what was left out.
std::string describe_transfer(const Transfer& transfer, Eigen::Index channels);

}  // namespace touchfield
