#pragma once

#include <cmath>
#include <memory>
#include <utility>
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

/// 12 x 12 sources of 40 kHz without directivity, 100 mm below a sheet of 36 x 36 mm that does not scatter, of which a
/// strip of 8 x 12 mm is pressed. The slopes are central differences on its points, 1.5 mm apart. P' is 1.
///
/// level   P' as a share of what the middle hears if all channels add up
inline RadiationProblem sheet_problem(double level) {
  constexpr int kChannels = 12;
  constexpr int kPoints = 25;
  constexpr double kPitch = 1.5e-3;
  const double k = 2.0 * M_PI / 8.58e-3;
  const auto place = [](int i) { return kPitch * (i - kPoints / 2); };
  std::vector<std::pair<int, int>> points;  // those with neighbours on all sides first
  for (const bool border : {false, true}) {
    for (int i = 0; i < kPoints * kPoints; ++i) {
      const int x = i % kPoints;
      const int y = i / kPoints;
      if (border == (x == 0 || y == 0 || x == kPoints - 1 || y == kPoints - 1)) {
        points.emplace_back(x, y);
      }
    }
  }
  const auto all = static_cast<Eigen::Index>(points.size());
  const Eigen::Index faces = (kPoints - 2) * (kPoints - 2);
  RadiationProblem problem;
  problem.rows.resize(all, kChannels * kChannels);
  problem.outside.resize(0, kChannels * kChannels);
  RadiationSkin& skin = problem.skin;
  skin.wanted = Eigen::VectorXd::Zero(faces);
  skin.energies = Eigen::VectorXd::Zero(all);
  std::vector<Eigen::Triplet<float>> entries;
  for (Eigen::Index j = 0; j < all; ++j) {
    const auto [x, y] = points[static_cast<std::size_t>(j)];
    for (Eigen::Index n = 0; n < problem.rows.cols(); ++n) {
      const double dx = 10e-3 * (static_cast<double>(n % kChannels) - 5.5) - place(x);
      const double dy = 10e-3 * (static_cast<double>(n / kChannels) - 5.5) - place(y);
      const double r = std::hypot(dx, dy, 0.1);
      problem.rows(j, n) = std::polar(0.1 / r, k * r);
    }
    const bool inside = std::abs(place(x)) < 4e-3 && std::abs(place(y)) < 6e-3;
    (inside ? skin.wanted(j) : skin.energies(j)) = 1.0;
    for (Eigen::Index i = 0; j < faces && i < all; ++i) {
      const int right = points[static_cast<std::size_t>(i)].first - x;
      const int up = points[static_cast<std::size_t>(i)].second - y;
      if (std::abs(right) + std::abs(up) == 1) {
        entries.emplace_back(2 * j + std::abs(up), i, static_cast<float>((right + up) / (2.0 * kPitch)));
      }
    }
  }
  auto slopes = std::make_shared<SkinSlopes>(2 * faces, all);
  slopes->setFromTriplets(entries.begin(), entries.end());
  skin.slopes = slopes;
  skin.weights = Eigen::VectorXd::Constant(faces, 1.0 / skin.wanted.sum());
  skin.press = 1.0 / (level * std::pow(problem.rows.row(faces / 2).cwiseAbs().sum(), 2));
  skin.flow = skin.press / (k * k);
  skin.energies *= 0.1 * skin.press / skin.wanted.sum();
  return problem;
}

}  // namespace touchfield
