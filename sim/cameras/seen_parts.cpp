#include "sim/cameras/seen_parts.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr double kThin = 8e-3;    // [m]
constexpr double kApart = 15e-3;  // [m]
constexpr Eigen::Index kLeastPartPoints = 20;
constexpr std::size_t kMostParts = 4;
constexpr double kWholeHand = 0.26;  // [m]

/// Which cube of a grid a point is in; neighbours along x, y, z differ by 1, kRow, kRow^2.
constexpr std::int64_t kRow = 1 << 20;
std::int64_t cube_of(const Vector3& x, double size) {
  const auto i = (x / size).array().floor().cast<std::int64_t>().eval();
  return (i.z() * kRow + i.y()) * kRow + i.x();
}

}  // namespace

SkinSamples SkinSamples::thinned(Eigen::Index most) const {
  const Eigen::Index step = std::max<Eigen::Index>(1, at.cols() / most);
  const auto some = Eigen::seqN(0, (at.cols() + step - 1) / step, step);
  return {at(Eigen::all, some), normal(Eigen::all, some)};
}

SkinSamples thinned_evenly(const HandPoints& points) {
  std::vector<std::pair<std::int64_t, Eigen::Index>> order;
  for (Eigen::Index p = 0; p < points.size(); ++p) {
    order.emplace_back(cube_of(points.at.col(p), kThin), p);
  }
  std::ranges::sort(order);
  SkinSamples samples{Points::Zero(3, points.size()), Points::Zero(3, points.size())};
  Eigen::Index count = 0;
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    for (; last < order.size() && order[last].first == order[first].first; ++last) {
      samples.at.col(count) += points.at.col(order[last].second);
      samples.normal.col(count) += points.normal.col(order[last].second);
    }
    samples.at.col(count) /= static_cast<double>(last - first);
    samples.normal.col(count++).normalize();
    first = last;
  }
  samples.at.conservativeResize(3, count);
  samples.normal.conservativeResize(3, count);
  return samples;
}

std::vector<SkinSamples> parts_of(const SkinSamples& samples) {
  std::vector<std::int64_t> cubes;
  for (const auto& x : samples.at.colwise()) {
    cubes.push_back(cube_of(x, kApart));
  }
  std::vector<std::int64_t> full = cubes;
  std::ranges::sort(full);
  full.erase(std::unique(full.begin(), full.end()), full.end());
  const auto place = [&](std::int64_t cube) {
    const auto found = std::ranges::lower_bound(full, cube);
    return found != full.end() && *found == cube ? found - full.begin() : -1;
  };
  DisjointSets sets(static_cast<Eigen::Index>(full.size()));
  for (std::size_t i = 0; i < full.size(); ++i) {
    for (int n = 14; n < 27; ++n) {  // half of the 26 neighbours
      const std::int64_t next = full[i] + ((n / 9 - 1) * kRow + n / 3 % 3 - 1) * kRow + n % 3 - 1;
      if (const auto other = place(next); other >= 0) {
        sets.join(static_cast<Eigen::Index>(i), other);
      }
    }
  }
  int count = 0;
  const std::vector<int> numbers = sets.numbered(count);
  std::vector<std::vector<Eigen::Index>> members(static_cast<std::size_t>(count));
  for (std::size_t s = 0; s < cubes.size(); ++s) {
    members[static_cast<std::size_t>(numbers[static_cast<std::size_t>(place(cubes[s]))])].push_back(
        static_cast<Eigen::Index>(s));
  }
  std::ranges::stable_sort(members, std::ranges::greater{}, &std::vector<Eigen::Index>::size);
  std::vector<SkinSamples> parts;
  for (const auto& member : members) {
    if (static_cast<Eigen::Index>(member.size()) >= kLeastPartPoints && parts.size() < kMostParts) {
      parts.push_back(samples.part(member));
    }
  }
  return parts;
}

Eigen::Matrix3d principal_axes(const Points& at) {
  const Points off = at.colwise() - at.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(off * off.transpose());
  const Vector3 along = solver.eigenvectors().col(2);
  const Vector3 out = solver.eigenvectors().col(0);
  Eigen::Matrix3d axes;
  axes << along.cross(out), along, out;
  return axes;
}

std::vector<PossibleHand> possible_hands(const SkinSamples& part) {
  const Eigen::VectorXd along = principal_axes(part.at).col(1).transpose() * part.at;
  const double least = along.minCoeff();
  const double most = along.maxCoeff();
  std::vector<PossibleHand> hands;
  if (most - least < kWholeHand) {
    hands.push_back({part, 0});
  }
  for (const int end : {1, 2}) {
    for (const double length : {0.19, 0.12}) {
      if (most - least > 1.1 * length) {
        std::vector<Eigen::Index> which;
        for (Eigen::Index s = 0; s < along.size(); ++s) {
          if (end == 1 ? along(s) < least + length : along(s) > most - length) {
            which.push_back(s);
          }
        }
        hands.push_back({part.part(which), end});
      }
    }
  }
  return hands;
}

}  // namespace touchfield
