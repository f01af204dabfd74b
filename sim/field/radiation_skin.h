#pragma once

#include <memory>
#include <vector>

#include "sim/acoustics/medium.h"
#include "sim/field/skin_problems.h"
#include "sim/field/target.h"
#include "sim/mesh/triangle_mesh.h"
#include "solvers/phase/radiation.h"

namespace touchfield {

/// The skin at a target on which method radiation counts P face by face. Farther skin counts by its energy alone: what
/// sound is left there is so weak that P^2 is small beside it.
struct NearSkin {
  static constexpr double kReach = 1.0;  // wavelengths, from the centroid of a target's face

  std::vector<Eigen::Index> faces;           // those near the target, ascending, then neighbours that slopes need
  Eigen::Index count = 0;                    // of the near ones
  std::shared_ptr<const SkinSlopes> slopes;  // of surface_slopes, 2 count x faces
};

NearSkin near_skin(const TriangleMesh& mesh, const Target& target, const Wave& wave);
/// The same of faces that are given, ascending, and their neighbours.
NearSkin near_skin(const TriangleMesh& mesh, std::vector<Eigen::Index> faces, const Wave& wave);

/// Sound-hard skin without faces: a and b of P alone.
RadiationSkin bare_skin(const Wave& wave);

/// The cost of method radiation, for wanted amplitudes p' of the target's faces, P' = p'^2 / (4 rho c^2):
///
///   cost = (sum_j A_j (s_j (P_j - P'_j)^2 + (1 - s_j) P_j^2) / S + nu sum_i C_i |p_i|^2 / (4 rho c^2)) / (S A_T)
///
/// over near faces j and all rows i; S the largest P', A_T the target's area. Near faces that are no skin have no part.
///
/// amplitudes       p', K [Pa], > 0
/// outside          of the mesh
/// outside_weight   nu
/// counted          C, area that each row stands for; first those of near.faces, then any number [m2]
RadiationSkin radiation_skin(const NearSkin& near, const TriangleMesh& mesh, const Target& target,
                             const Eigen::VectorXd& amplitudes, const OutsideSkin& outside, const Wave& wave,
                             double outside_weight, const Eigen::VectorXd& counted);

}  // namespace touchfield
