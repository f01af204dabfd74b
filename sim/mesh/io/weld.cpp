#include "sim/mesh/io/weld.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "sim/mesh/subset.h"

namespace touchfield {

std::pair<std::vector<int>, Points> merged(const std::vector<Vector3>& points) {
  const auto before = [&](std::size_t i, std::size_t j) {
    return std::lexicographical_compare(points[i].begin(), points[i].end(), points[j].begin(), points[j].end());
  };
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), before);
  std::vector<std::size_t> first(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool repeated = i > 0 && !before(order[i - 1], order[i]);
    first[order[i]] = repeated ? first[order[i - 1]] : order[i];
  }
  std::vector<int> number(points.size());
  Points unique(3, static_cast<Eigen::Index>(points.size()));
  int count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (first[i] == i) {
      number[i] = count;
      unique.col(count++) = points[i];
    } else {
      number[i] = number[first[i]];
    }
  }
  unique.conservativeResize(3, count);
  return {std::move(number), std::move(unique)};
}

WeldedSurface welded(const FileSurface& surface, double unit) {
  std::vector<int> place(surface.points.size(), -1);  // among the points that a triangle names
  for (const auto& triangle : surface.triangles) {
    for (const std::int64_t v : triangle) {
      place[static_cast<std::size_t>(v)] = 0;
    }
  }
  std::vector<Vector3> named;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] == 0) {
      place[v] = static_cast<int>(named.size());
      named.push_back(surface.points[v] * unit);
    }
  }
  auto [number, points] = merged(named);
  WeldedSurface result;
  result.unreferenced = static_cast<Eigen::Index>(place.size() - named.size());
  result.welded = static_cast<Eigen::Index>(named.size()) - points.cols();
  result.points = std::move(points);
  result.triangles.resize(3, static_cast<Eigen::Index>(surface.triangles.size()));
  Eigen::Index count = 0;
  for (const auto& triangle : surface.triangles) {
    Eigen::Vector3i face;
    for (std::size_t c = 0; c < 3; ++c) {
      face(static_cast<Eigen::Index>(c)) =
          number[static_cast<std::size_t>(place[static_cast<std::size_t>(triangle[c])])];
    }
    if (face(0) == face(1) || face(1) == face(2) || face(2) == face(0)) {
      ++result.collapsed_faces;
    } else {
      result.triangles.col(count++) = face;
    }
  }
  result.triangles.conservativeResize(3, count);
  return result;
}

Triangles without_duplicates(const Triangles& triangles) {
  struct Entry {
    std::array<int, 3> sorted;
    Eigen::Index face;
  };
  std::vector<Entry> entries;
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    Entry& entry = entries.emplace_back(Entry{{triangles(0, f), triangles(1, f), triangles(2, f)}, f});
    std::ranges::sort(entry.sorted);
  }
  std::ranges::stable_sort(entries, [](const Entry& e, const Entry& g) { return e.sorted < g.sorted; });
  std::vector<bool> is_kept(entries.size(), false);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    is_kept[static_cast<std::size_t>(entries[i].face)] = i == 0 || entries[i].sorted != entries[i - 1].sorted;
  }
  return faces_where(triangles, [&](Eigen::Index f) { return is_kept[static_cast<std::size_t>(f)]; });
}

}  // namespace touchfield
