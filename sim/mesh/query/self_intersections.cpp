#include "sim/mesh/query/self_intersections.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/mesh/query/box_tree.h"
#include "sim/mesh/query/triangle_pair.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;
using Pairs = std::vector<std::pair<Index, Index>>;

/// The pairs of a face f of `one` and a face g >= first(f) of `other` that cut each other, in order. Goes through `one`
/// in blocks, each twice as long as the last, and ends with the block that makes them enough: what is found does not
/// depend on the threads.
template <class First>
Pairs cutting_pairs(const TriangleMesh& one, const std::vector<Box>& boxes, const TriangleMesh& other,
                    const BoxTree& tree, const First& first, std::size_t most) {
  Pairs pairs;
  std::vector<std::vector<Index>> cutting;
  Index length = 2048;
  for (Index begin = 0; begin < one.face_count() && pairs.size() < most; begin += length, length *= 2) {
    const Index end = std::min(one.face_count(), begin + length);
    cutting.assign(static_cast<std::size_t>(end - begin), {});
#pragma omp parallel for schedule(dynamic, 64) if (end - begin > 1024)
    for (Index f = begin; f < end; ++f) {
      const Corners face = corners(one, f);
      std::vector<Index>& found = cutting[static_cast<std::size_t>(f - begin)];
      tree.for_each_meeting(boxes[static_cast<std::size_t>(f)], [&](Index g) {
        if (g >= first(f) && found.size() < most && cut_each_other(face, corners(other, g))) {
          found.push_back(g);
        }
      });
      std::sort(found.begin(), found.end());
    }
    for (Index f = begin; f < end; ++f) {
      for (const Index g : cutting[static_cast<std::size_t>(f - begin)]) {
        pairs.emplace_back(f, g);
      }
    }
  }
  pairs.resize(std::min(pairs.size(), most));
  return pairs;
}

}  // namespace

Pairs self_intersections(const TriangleMesh& mesh, std::size_t most) {
  const std::vector<Box> boxes = boxes_round_faces(mesh, kTouch);
  return cutting_pairs(
      mesh, boxes, mesh, BoxTree(boxes), [](Index f) { return f + 1; }, most);
}

std::string self_intersections_text(const TriangleMesh& mesh, const Pairs& pairs, std::size_t most) {
  if (pairs.empty()) {
    return {};
  }
  const auto [one, other] = pairs.front();
  return fmt::format("{} of faces intersect, the first near {}",
                     counted(static_cast<Index>(pairs.size()), "pair", pairs.size() < most ? "pairs" : "pairs or more"),
                     place_text(0.5 * (mesh.centroids().col(one) + mesh.centroids().col(other)), 2));
}

Pairs intersections(const TriangleMesh& one, const TriangleMesh& other, std::size_t most) {
  return cutting_pairs(
      one, boxes_round_faces(one, kTouch), other, BoxTree(boxes_round_faces(other, kTouch)), [](Index) { return 0; },
      most);
}

}  // namespace touchfield
