#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/hand/implicit_surface.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr int kBlock = 4;           // nodes along a block's side; the blur and the spline reach as far
constexpr int kMargin = 8;          // nodes about the body
constexpr int kDepth = 4;           // spacings below the skin to which gaps are closed
constexpr double kSteepest = 1.25;  // bound on the gradient of a SoftBody
constexpr double kNoise = 0.06;     // of the spacing: how far the sampled free surface is off

/// Weights of a cubic B-spline at 4 nodes, t in 0..1 between the middle two, and their slopes.
struct Weights {
  explicit Weights(double t) {
    const double s = 1.0 - t;
    value = {s * s * s / 6.0, (3.0 * t * t * (t - 2.0) + 4.0) / 6.0, (3.0 * s * s * (s - 2.0) + 4.0) / 6.0,
             t * t * t / 6.0};
    slope = {-0.5 * s * s, t * (1.5 * t - 2.0), s * (2.0 - 1.5 * s), 0.5 * t * t};
  }
  std::array<double, 4> value;
  std::array<double, 4> slope;
};

}  // namespace

FinishedSkin::FinishedSkin(const SkinFunction& body, double radius, double spacing)
    : radius_(radius), spacing_(spacing), origin_(body.lower.array() - kMargin * spacing) {
  const Vector3 size = (body.upper - body.lower) / spacing_;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    blocks_[axis] = static_cast<int>((size(static_cast<Eigen::Index>(axis)) + 2.0 * kMargin) / kBlock) + 1;
    nodes_[axis] = blocks_[axis] * kBlock;
  }
  sample(body);
  close_gaps();
  fill_cavities();
  blur();
  near_skin_ = {};
}

template <class Visit>
void FinishedSkin::for_each_block(const Visit& visit) const {
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < blocks_[2]; ++k) {
    for (int j = 0; j < blocks_[1]; ++j) {
      for (int i = 0; i < blocks_[0]; ++i) {
        visit(Node{i, j, k});
      }
    }
  }
}

template <class Visit>
void FinishedSkin::for_each_node(const Node& block, const Visit& visit) const {
  for (int k = kBlock * block[2]; k < kBlock * (block[2] + 1); ++k) {
    for (int j = kBlock * block[1]; j < kBlock * (block[1] + 1); ++j) {
      for (int i = kBlock * block[0]; i < kBlock * (block[0] + 1); ++i) {
        visit(Node{i, j, k});
      }
    }
  }
}

/// The body's function in all blocks that its closed skin may cross, and in those next to them; its value in the middle
/// all over any other block.
void FinishedSkin::sample(const SkinFunction& body) {
  const auto blocks = static_cast<std::size_t>(blocks_[0] * blocks_[1] * blocks_[2]);
  constexpr double kHalf = 0.5 * kBlock;
  const double reach = kSteepest * std::sqrt(3.0) * kHalf * spacing_;
  const auto middle_of = [&](const Node& block) {
    return Vector3(point({kBlock * block[0], kBlock * block[1], kBlock * block[2]}) +
                   Vector3::Constant(kHalf * spacing_));
  };
  std::vector<float> middle(blocks);
  known_.assign(blocks, 0);
  for_each_block([&](const Node& block) {
    const double f = body.distance(middle_of(block));
    middle[block_index(block)] = static_cast<float>(f);
    known_[block_index(block)] = f > -reach && f < reach + radius_ ? 1 : 0;
  });
  const auto any_known_about = [&](const Node& block) {
    for (int k = std::max(block[2] - 1, 0); k <= std::min(block[2] + 1, blocks_[2] - 1); ++k) {
      for (int j = std::max(block[1] - 1, 0); j <= std::min(block[1] + 1, blocks_[1] - 1); ++j) {
        for (int i = std::max(block[0] - 1, 0); i <= std::min(block[0] + 1, blocks_[0] - 1); ++i) {
          if (known_[block_index({i, j, k})] != 0) {
            return true;
          }
        }
      }
    }
    return false;
  };
  values_.resize(blocks * kBlock * kBlock * kBlock);
  for_each_block([&](const Node& block) {
    if (!any_known_about(block)) {
      for_each_node(block, [&](const Node& n) { values_[index(n)] = middle[block_index(block)]; });
      return;
    }
    const SkinFunction::Distance near = body.within(middle_of(block), std::sqrt(3.0) * kHalf * spacing_);
    for_each_node(block, [&](const Node& n) { values_[index(n)] = static_cast<float>(near(point(n))); });
  });
  for (int k = 1; k < nodes_[2] - 1; ++k) {
    for (int j = 1; j < nodes_[1] - 1; ++j) {
      for (int i = 1; i < nodes_[0] - 1; ++i) {
        const float f = values_[index({i, j, k})];
        if (f > -kDepth * spacing_ && f < radius_) {
          near_skin_.push_back({i, j, k});
        }
      }
    }
  }
}

/// Where the grid's edges cross f = r. For the nodes at their ends, the number of the nearest such point; -1 for
/// others.
Points FinishedSkin::free_surface(std::vector<int>& nearest) const {
  const auto level = static_cast<float>(radius_);
  std::vector<Vector3> crossings;
  nearest.assign(values_.size(), -1);
  const auto offer = [&](const Node& n, int crossing) {
    int& best = nearest[index(n)];
    const auto distance = [&](int c) { return (crossings[static_cast<std::size_t>(c)] - point(n)).squaredNorm(); };
    if (best < 0 || distance(crossing) < distance(best)) {
      best = crossing;
    }
  };
  for (const Node& here : near_skin_) {
    const float f = values_[index(here)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Node there = here;
        there[axis] += step;
        const float g = values_[index(there)];
        if (g >= level) {
          const auto t = static_cast<double>((level - f) / (g - f));
          crossings.emplace_back(point(here) + t * (point(there) - point(here)));
          offer(here, static_cast<int>(crossings.size()) - 1);
        }
      }
    }
  }
  return as_columns(crossings);
}

/// Hands the nearest free point on from node to node (Danielsson's distance transform), there and back twice.
void FinishedSkin::close_gaps() {
  std::vector<int> nearest;
  const Points free = free_surface(nearest);
  const auto distance = [&](const Node& n, int crossing) { return (free.col(crossing) - point(n)).norm(); };
  const auto ask_neighbours = [&](const Node& n, int sign) {  // those that the sweep has passed
    int& best = nearest[index(n)];
    double least = best < 0 ? std::numeric_limits<double>::infinity() : distance(n, best);
    for (int c = 0; c < 13; ++c) {
      const int offered =
          nearest[index({n[0] + sign * (c % 3 - 1), n[1] + sign * (c / 3 % 3 - 1), n[2] + sign * (c / 9 - 1)})];
      if (offered >= 0 && offered != best && distance(n, offered) < least) {
        least = distance(n, offered);
        best = offered;
      }
    }
  };
  for (int there_and_back = 0; there_and_back < 2; ++there_and_back) {
    std::for_each(near_skin_.begin(), near_skin_.end(), [&](const Node& n) { ask_neighbours(n, 1); });
    std::for_each(near_skin_.rbegin(), near_skin_.rend(), [&](const Node& n) { ask_neighbours(n, -1); });
  }
  const double most = radius_ + kDepth * spacing_;
  for (const Node& n : near_skin_) {
    const int crossing = nearest[index(n)];
    const double free_at = crossing < 0 ? most : std::min(distance(n, crossing), most);
    float& value = values_[index(n)];
    value = std::min(value, static_cast<float>(radius_ - free_at + kNoise * spacing_));
  }
}

/// Turns what no path of free nodes joins to the outside into flesh, at least a spacing deep, so that the blur leaves
/// nothing of the cavity's walls.
void FinishedSkin::fill_cavities() {
  std::vector<char> outside(values_.size(), 1);  // the grid's border needs no visit
  for_each_block([&](const Node& block) {
    for_each_node(block, [&](const Node& n) {
      const auto within = [&](std::size_t axis) { return n[axis] > 0 && n[axis] < nodes_[axis] - 1; };
      outside[index(n)] = within(0) && within(1) && within(2) ? 0 : 1;
    });
  });
  const std::array<std::size_t, 3> strides = {1, index({0, 1, 0}), index({0, 0, 1})};
  std::vector<std::size_t> front = {index({1, 1, 1})};
  while (!front.empty()) {
    const std::size_t at = front.back();
    front.pop_back();
    for (const std::size_t stride : strides) {
      for (const std::size_t next : {at - stride, at + stride}) {
        if (outside[next] == 0 && values_[next] > 0) {
          outside[next] = 1;
          front.push_back(next);
        }
      }
    }
  }
  for (std::size_t n = 0; n < values_.size(); ++n) {
    if (values_[n] > 0 && outside[n] == 0) {
      values_[n] = -std::max(values_[n], static_cast<float>(spacing_));
    }
  }
}

/// Binomial weights 1 4 6 4 1 along each axis: a standard deviation of one spacing.
void FinishedSkin::blur() {
  std::vector<float> line_values;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Node step{0, 0, 0};
    step[axis] = 1;
    const auto stride = static_cast<std::ptrdiff_t>(index(step));
    line_values = values_;
    for_each_block([&](const Node& block) {
      for_each_node(block, [&](const Node& n) {
        if (n[axis] >= 2 && n[axis] < nodes_[axis] - 2) {
          const float* at = line_values.data() + index(n);
          values_[index(n)] =
              (6.0F * at[0] + 4.0F * (at[stride] + at[-stride]) + at[2 * stride] + at[-2 * stride]) / 16.0F;
        }
      });
    });
  }
}

bool FinishedSkin::covers(const Vector3& x) const {
  const Vector3 cell = (x - origin_) / spacing_;
  Node block;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double place = std::floor(cell(static_cast<Eigen::Index>(axis)));
    if (!(place >= 1 && place < nodes_[axis] - 2)) {
      return false;
    }
    block[axis] = static_cast<int>(place) / kBlock;
  }
  return known_[block_index(block)] != 0;
}

ImplicitValue FinishedSkin::at(const Vector3& x) const {
  const Vector3 cell = (x - origin_) / spacing_;
  const Vector3 low = cell.array().floor();
  const std::array<Weights, 3> weights = {Weights(cell.x() - low.x()), Weights(cell.y() - low.y()),
                                          Weights(cell.z() - low.z())};
  const Node first{static_cast<int>(low.x()) - 1, static_cast<int>(low.y()) - 1, static_cast<int>(low.z()) - 1};
  ImplicitValue sum{0.0, Vector3::Zero()};
  for (int c = 0; c < 4; ++c) {
    for (int b = 0; b < 4; ++b) {
      const float* row = values_.data() + index({first[0], first[1] + b, first[2] + c});
      double value = 0;
      double slope = 0;
      for (std::size_t a = 0; a < 4; ++a) {
        value += weights[0].value[a] * static_cast<double>(row[a]);
        slope += weights[0].slope[a] * static_cast<double>(row[a]);
      }
      const auto [wy, sy] =
          std::pair(weights[1].value[static_cast<std::size_t>(b)], weights[1].slope[static_cast<std::size_t>(b)]);
      const auto [wz, sz] =
          std::pair(weights[2].value[static_cast<std::size_t>(c)], weights[2].slope[static_cast<std::size_t>(c)]);
      sum.distance += wy * wz * value;
      sum.gradient += Vector3(wy * wz * slope, sy * wz * value, wy * sz * value);
    }
  }
  sum.gradient /= spacing_;
  return sum;
}

}  // namespace touchfield
