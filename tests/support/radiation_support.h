#pragma once

#include <memory>
#include <vector>

#include "solvers/phase/radiation.h"
#include "tests/support/skin_support.h"

namespace touchfield {

/// Faces with neighbours and skin outside, all random, in units in which the largest P' is 1 and the faces' weights are
/// 1 together.
///
/// level   P' as a share of what a face hears if all channels add up
inline RadiationProblem random_radiation_problem(Eigen::Index faces, Eigen::Index neighbours, Eigen::Index rank,
                                                 Eigen::Index channels, double level, unsigned seed) {
  Uniform uniform(seed);
  RadiationProblem problem;
  problem.rows = random_matrix(faces + neighbours, channels, uniform);
  problem.outside = random_matrix(rank, channels, uniform);
  const Eigen::Index all = faces + neighbours + rank;
  std::vector<Eigen::Triplet<float>> entries;
  for (Eigen::Index row = 0; row < 2 * faces; ++row) {
    for (Eigen::Index column = 0; column < faces + neighbours; ++column) {
      if (uniform(0.0, 1.0) < 0.5) {
        entries.emplace_back(row, column, static_cast<float>(uniform(-1.0, 1.0)));
      }
    }
  }
  auto slopes = std::make_shared<SkinSlopes>(2 * faces, faces + neighbours);
  slopes->setFromTriplets(entries.begin(), entries.end());
  RadiationSkin& skin = problem.skin;
  skin.slopes = slopes;
  const double reach = problem.rows.row(0).cwiseAbs().sum();
  skin.press = 1.0 / (level * reach * reach);
  skin.flow = 0.05 * skin.press;
  skin.wanted.resize(faces);
  skin.weights.resize(faces);
  for (Eigen::Index j = 0; j < faces; ++j) {
    skin.wanted(j) = j % 4 == 3 ? 0.0 : uniform(0.5, 1.0);
    skin.weights(j) = uniform(0.5, 2.0);
  }
  skin.weights /= skin.weights.sum();
  skin.energies = Eigen::VectorXd::Zero(all);
  skin.energies.tail(rank).setConstant(0.05 * skin.press);
  return problem;
}

}  // namespace touchfield
