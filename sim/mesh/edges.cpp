#include "sim/mesh/edges.h"

#include <algorithm>
#include <tuple>
#include <vector>

namespace touchfield {

EdgeTable edge_table(const Triangles& triangles) {
  struct Side {
    int low;
    int high;
    Eigen::Index number;  // 3 face + corner
  };
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(triangles.size()));
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax(triangles(c, f), triangles((c + 1) % 3, f));
      sides.push_back({low, high, 3 * f + c});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
    return std::tie(s.low, s.high, s.number) < std::tie(t.low, t.high, t.number);
  });

  EdgeTable table;
  table.ends.resize(2, triangles.size());
  table.of_face.resize(3, triangles.cols());
  int count = 0;
  for (const Side& side : sides) {
    const Eigen::Vector2i ends(side.low, side.high);
    if (count == 0 || table.ends.col(count - 1) != ends) {
      table.ends.col(count++) = ends;
    }
    table.of_face(side.number % 3, side.number / 3) = count - 1;
  }
  table.ends.conservativeResize(2, count);
  return table;
}

}  // namespace touchfield
