#include "sim/cameras/vertex_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace touchfield {

namespace {

constexpr double kTurnedAway = 10e-3;  // s [m]

}  // namespace

int VertexGrid::cell(int axis, double x) const {
  const double along = (x - lower_(axis)) / reach_;
  return static_cast<int>(
      std::floor(std::clamp(along, -2.0, static_cast<double>(counts_[static_cast<std::size_t>(axis)]) + 1.0)));
}

void VertexGrid::build(const Points& vertices, const Points& normals, double reach) {
  reach_ = reach;
  lower_ = vertices.rowwise().minCoeff();
  const Vector3 size = vertices.rowwise().maxCoeff() - lower_;
  for (int axis = 0; axis < 3; ++axis) {
    counts_[static_cast<std::size_t>(axis)] = static_cast<int>(size(axis) / reach) + 1;
  }
  const auto count = static_cast<std::size_t>(vertices.cols());
  starts_.assign(index({0, 0, counts_[2]}) + 1, 0);
  next_.resize(count);
  for (std::size_t v = 0; v < count; ++v) {
    const auto x = vertices.col(static_cast<Eigen::Index>(v));
    const std::size_t c = index({cell(0, x(0)), cell(1, x(1)), cell(2, x(2))});
    next_[v] = static_cast<int>(c);
    ++starts_[c + 1];
  }
  for (std::size_t c = 1; c < starts_.size(); ++c) {
    starts_[c] += starts_[c - 1];
  }
  entries_.resize(count);
  // Filled from the back, so that the ends become the starts.
  for (std::size_t v = count; v-- > 0;) {
    const auto column = static_cast<Eigen::Index>(v);
    const auto place = static_cast<std::size_t>(--starts_[static_cast<std::size_t>(next_[v]) + 1]);
    entries_[place] = {vertices.col(column), normals.col(column), static_cast<int>(v)};
  }
  starts_.erase(starts_.begin());
  starts_.push_back(static_cast<int>(count));
}

/// Calls visit(entry, squared distance) with all that may be within reach.
template <typename Visit>
void VertexGrid::visit_near(const Vector3& at, const Visit& visit) const {
  std::array<int, 3> first;
  std::array<int, 3> last;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const int middle = cell(axis, at(axis));
    first[i] = std::max(middle - 1, 0);
    last[i] = std::min(middle + 1, counts_[i] - 1);
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      if (first[0] > last[0]) {
        continue;
      }
      const auto from = static_cast<std::size_t>(starts_[index({first[0], j, k})]);
      const auto to = static_cast<std::size_t>(starts_[index({last[0], j, k}) + 1]);
      for (std::size_t e = from; e < to; ++e) {
        visit(entries_[e], (entries_[e].at - at).squaredNorm());
      }
    }
  }
}

int VertexGrid::nearest(const Vector3& at, const Vector3& normal) const {
  int best = -1;
  const double farthest = reach_ * reach_;
  double least = std::numeric_limits<double>::infinity();
  visit_near(at, [&](const Entry& entry, double squared) {
    if (squared >= std::min(least, farthest)) {
      return;
    }
    const double cost = squared + 2 * kTurnedAway * kTurnedAway * (1 - entry.normal.dot(normal));
    if (cost < least) {
      least = cost;
      best = entry.vertex;
    }
  });
  return best;
}

double VertexGrid::squared_distance(const Vector3& at) const {
  double least = std::numeric_limits<double>::infinity();
  visit_near(at, [&](const Entry&, double squared) { least = std::min(least, squared); });
  return least <= reach_ * reach_ ? least : std::numeric_limits<double>::infinity();
}

}  // namespace touchfield
