#include "sim/cameras/deformation_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

/// u x as a matrix: cross(u) v = u x v.
Eigen::Matrix3d cross(const Vector3& u) {
  Eigen::Matrix3d matrix;
  matrix << 0, -u.z(), u.y(), u.z(), 0, -u.x(), -u.y(), u.x(), 0;
  return matrix;
}

void require_sizes(const DeformationGraph& graph, const SkinTargets& targets, const Points& before,
                   const NodeMotions& motions) {
  const Eigen::Index count = targets.at.cols();
  if (targets.target.cols() != count || targets.normal.cols() != count || targets.weight.size() != count ||
      static_cast<Eigen::Index>(targets.skin.face.size()) != count || targets.skin.weights.cols() != count) {
    throw InputError(fmt::format(
        "deformation: {} points, {} targets, {} normals, {} weights and {} bound points must "
        "be as many",
        count, targets.target.cols(), targets.normal.cols(), targets.weight.size(), targets.skin.face.size()));
  }
  if (motions.shift.cols() != graph.node_count() || (before.cols() != 0 && before.cols() != graph.node_count())) {
    throw InputError(fmt::format("deformation: {} shifts, {} before, the graph has {} nodes", motions.shift.cols(),
                                 before.cols(), graph.node_count()));
  }
}

}  // namespace

DeformationFit::DeformationFit(DeformationGraph graph) : graph_(std::move(graph)) {
  star_starts_.push_back(0);
  for (int i = 0; i < graph_.node_count(); ++i) {
    stars_.push_back(i);
    stars_.insert(stars_.end(), graph_.neighbours(i).begin(), graph_.neighbours(i).end());
    std::sort(stars_.begin() + static_cast<std::ptrdiff_t>(star_starts_.back()), stars_.end());
    star_starts_.push_back(stars_.size());
  }
  find_pattern();
  solver_.analyzePattern(system_.matrix);
}

void DeformationFit::find_pattern() {
  const auto nodes = static_cast<std::size_t>(graph_.node_count());
  std::vector<std::map<int, int>> columns(nodes);  // row: block
  const auto for_each_pair = [](std::span<const int> group, const auto& visit) {
    for (std::size_t k = 0; k < group.size(); ++k) {
      for (std::size_t l = 0; l <= k; ++l) {
        visit(group[k], static_cast<std::size_t>(group[l]));
      }
    }
  };
  const auto for_each_group = [&](const auto& visit) {
    for (int f = 0; f < graph_.face_count(); ++f) {
      visit(graph_.nodes_of(f), of_faces_);
    }
    for (std::size_t i = 0; i < nodes; ++i) {
      visit(std::span<const int>(stars_).subspan(star_starts_[i], star_starts_[i + 1] - star_starts_[i]), of_stars_);
    }
  };
  for_each_group([&](std::span<const int> group, Pairs&) {
    for_each_pair(group, [&](int row, std::size_t column) { columns[column][row] = 0; });
  });
  std::vector<Eigen::Triplet<double>> entries;
  columns_.push_back(0);
  for (std::size_t j = 0; j < nodes; ++j) {
    for (auto& [row, block] : columns[j]) {
      block = static_cast<int>(rows_.size());
      rows_.push_back(row);
      for (int c = 0; c < 3; ++c) {
        for (int r = 0; r < 3; ++r) {
          entries.emplace_back(3 * row + r, 3 * static_cast<int>(j) + c, 1.0);
        }
      }
    }
    columns_.push_back(rows_.size());
  }
  for_each_group([&](std::span<const int> group, Pairs& pairs) {
    pairs.starts.push_back(pairs.blocks.size());
    for_each_pair(group, [&](int row, std::size_t column) { pairs.blocks.push_back(columns[column][row]); });
  });
  blocks_.resize(9, static_cast<Eigen::Index>(rows_.size()));
  system_.matrix.resize(3 * graph_.node_count(), 3 * graph_.node_count());
  system_.matrix.setFromTriplets(entries.begin(), entries.end());
  system_.gradient.resize(3 * graph_.node_count());
}

void DeformationFit::add_targets(const SkinTargets& targets, const NodeMotions& motions) {
  for (Eigen::Index p = 0; p < targets.at.cols(); ++p) {
    const double weight = targets.weight(p);
    if (weight == 0) {
      continue;
    }
    const int face = targets.skin.face[static_cast<std::size_t>(p)];
    const std::span<const int> nodes = graph_.nodes_of(face);
    const auto weights = graph_.weights_of(face, targets.skin.weights.col(p));
    const Vector3 normal = targets.normal.col(p);
    const double off = normal.dot(moved(motions, nodes, weights, targets.at.col(p)) - targets.target.col(p));
    residual_ += weight * off * off;
    const Eigen::Matrix3d plane = weight * normal * normal.transpose();
    std::size_t pair = of_faces_.starts[static_cast<std::size_t>(face)];
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double share = weights(static_cast<Eigen::Index>(k));
      system_.gradient.segment<3>(3 * static_cast<Eigen::Index>(nodes[k])) += weight * off * share * normal;
      for (std::size_t l = 0; l <= k; ++l) {
        blocks_.col(of_faces_.blocks[pair++]) += share * weights(static_cast<Eigen::Index>(l)) * plane.reshaped();
      }
    }
  }
}

/// With edges a_j = R_i (g_j - g_i), residuals r_j and a turn w on top of R_i each term is |r_j + d_j - d_i + a_j x
/// w|^2. The best turn, w = -M^-1 sum_j A_j^T (d_j - d_i) with A_j v = a_j x v, M = sum_j A_j^T A_j (the residuals of
/// the best R_i have sum_j A_j^T r_j = 0), leaves sum_j |r_j + d_j - d_i|^2 - |sum_j A_j^T (d_j - d_i)|^2_(M^-1).
void DeformationFit::add_edges(double weight, const NodeMotions& motions) {
  std::vector<Eigen::Matrix3d> lever;  // A_j^T of each node of the star
  std::vector<Eigen::Matrix3d> turned;
  for (int i = 0; i < graph_.node_count(); ++i) {
    const std::size_t first = star_starts_[static_cast<std::size_t>(i)];
    const auto star =
        std::span<const int>(stars_).subspan(first, star_starts_[static_cast<std::size_t>(i) + 1] - first);
    lever.assign(star.size(), Eigen::Matrix3d::Zero());
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    const Eigen::Matrix3d& turn = motions.turn[static_cast<std::size_t>(i)];
    std::size_t middle = 0;
    for (std::size_t k = 0; k < star.size(); ++k) {
      const int j = star[k];
      if (j == i) {
        middle = k;
        continue;
      }
      const Vector3 edge = motions.at.col(j) - motions.at.col(i);
      const Vector3 turned_edge = turn * edge;
      const Vector3 off = edge + motions.shift.col(j) - motions.shift.col(i) - turned_edge;
      system_.energy += weight * off.squaredNorm();
      system_.gradient.segment<3>(3 * static_cast<Eigen::Index>(j)) += weight * off;
      system_.gradient.segment<3>(3 * static_cast<Eigen::Index>(i)) -= weight * off;
      lever[k] = -cross(turned_edge);
      sum += lever[k];
      inertia += lever[k] * lever[k].transpose();
    }
    lever[middle] = -sum;
    inertia.diagonal().array() += 1e-9 * inertia.trace();  // neighbours on a line
    const Eigen::Matrix3d inverse = inertia.inverse();
    std::size_t pair = of_stars_.starts[static_cast<std::size_t>(i)];
    for (std::size_t k = 0; k < star.size(); ++k) {
      const Eigen::Matrix3d row = -weight * lever[k].transpose() * inverse;
      for (std::size_t l = 0; l <= k; ++l) {
        Eigen::Matrix3d block = row * lever[l];
        if (k == middle && l == middle) {
          block.diagonal().array() += weight * static_cast<double>(star.size() - 1);
        } else if (k == l) {
          block.diagonal().array() += weight;
        } else if (k == middle || l == middle) {
          block.diagonal().array() -= weight;
        }
        blocks_.col(of_stars_.blocks[pair++]) += block.reshaped();
      }
    }
  }
}

void DeformationFit::add_priors(const DeformationPriors& priors, const Points& before, const NodeMotions& motions) {
  for (Eigen::Index i = 0; i < graph_.node_count(); ++i) {
    const Vector3 shift = motions.shift.col(i);
    Vector3 change = shift;
    if (before.cols() != 0) {
      change -= motions.frame[static_cast<std::size_t>(i)] * before.col(i);
    }
    system_.energy += priors.rest * shift.squaredNorm() + priors.before * change.squaredNorm();
    system_.gradient.segment<3>(3 * i) += priors.rest * shift + priors.before * change;
    // The first block of a column is its diagonal one.
    auto diagonal = blocks_.col(static_cast<Eigen::Index>(columns_[static_cast<std::size_t>(i)])).reshaped(3, 3);
    diagonal.diagonal().array() += priors.rest + priors.before;
  }
}

const DeformationFit::System& DeformationFit::linearise(const SkinTargets& targets, const DeformationPriors& priors,
                                                        const Points& before, const NodeMotions& motions) {
  require_sizes(graph_, targets, before, motions);
  blocks_.setZero();
  system_.gradient.setZero();
  system_.energy = 0;
  residual_ = 0;
  add_targets(targets, motions);
  system_.energy += residual_;
  add_edges(priors.rigid, motions);
  add_priors(priors, before, motions);
  double* value = system_.matrix.valuePtr();
  for (std::size_t j = 0; j + 1 < columns_.size(); ++j) {
    for (Eigen::Index c = 0; c < 3; ++c) {
      for (std::size_t b = columns_[j]; b < columns_[j + 1]; ++b) {
        value = std::copy_n(&blocks_(3 * c, static_cast<Eigen::Index>(b)), 3, value);
      }
    }
  }
  return system_;
}

double DeformationFit::fit(const SkinTargets& targets, const DeformationPriors& priors, const Points& before, int steps,
                           NodeMotions& motions) {
  for (int step = 0; step < steps; ++step) {
    linearise(targets, priors, before, motions);
    if (step == 0) {  // later steps change the matrix by the turns of the second term alone
      solver_.factorize(system_.matrix);
      if (solver_.info() != Eigen::Success) {
        throw NumericalError("deformation: what was seen and the priors leave a node free");
      }
    }
    const Eigen::VectorXd change = solver_.solve(-system_.gradient);
    motions.shift += change.reshaped(3, graph_.node_count());
    graph_.turn(motions);
  }
  const double total = targets.weight.sum();
  return total > 0 ? std::sqrt(residual_ / total) : 0.0;
}

}  // namespace touchfield
