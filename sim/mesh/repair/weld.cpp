#include "sim/mesh/repair/weld.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/mixed_bits.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;
using Cell = std::array<std::int64_t, 3>;

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t part : cell) {
      hash = mixed_bits(hash + static_cast<std::uint64_t>(part));
    }
    return static_cast<std::size_t>(hash);
  }
};

void require_surface(const FileSurface& surface) {
  if (surface.points.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      surface.triangles.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 3) {
    throw InputError(
        fmt::format("mesh: {} points and {} faces are too many", surface.points.size(), surface.triangles.size()));
  }
  const auto bad_point = [](const Vector3& point) { return !point.allFinite(); };
  const auto bad_points = std::count_if(surface.points.begin(), surface.points.end(), bad_point);
  if (bad_points > 0) {
    const auto first = std::find_if(surface.points.begin(), surface.points.end(), bad_point);
    throw InputError(
        fmt::format("mesh: {} of {} points have a coordinate that is not a finite number, the first is point {}",
                    bad_points, surface.points.size(), first - surface.points.begin()));
  }
  const auto count = static_cast<std::int64_t>(surface.points.size());
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    const auto [least, most] = std::minmax_element(surface.triangles[f].begin(), surface.triangles[f].end());
    if (*least < 0 || *most >= count) {
      throw InputError(fmt::format("mesh: face {} names a point outside 0..{}", f, count - 1));
    }
  }
}

/// Points kept so far, found by place.
class KeptPoints {
 public:
  KeptPoints(Index most, double tolerance) : tolerance_(tolerance), points_(3, most), next_in_cell_() {
    cells_.reserve(static_cast<std::size_t>(most));
  }

  /// The number of the kept point that `point` becomes.
  int add(const Vector3& point) {
    const int found = tolerance_ > 0 ? nearest(point) : equal(point);
    return found >= 0 ? found : keep(point, cell_of(point));
  }

  int count() const { return count_; }
  Points points() const { return points_.leftCols(count_); }

 private:
  // Wide against the tolerance, so that most points look into one cell only.
  static constexpr double kCell = 16.0;

  Cell cell_of(const Vector3& point) const {
    Cell cell{};
    for (int i = 0; i < 3; ++i) {
      const auto part = static_cast<std::size_t>(i);
      cell[part] = tolerance_ > 0 ? static_cast<std::int64_t>(std::floor(point(i) / (kCell * tolerance_)))
                                  : std::bit_cast<std::int64_t>(point(i) + 0.0);  // -0 is 0
    }
    return cell;
  }

  int equal(const Vector3& point) const {
    const auto found = cells_.find(cell_of(point));
    return found == cells_.end() ? -1 : found->second;
  }

  int nearest(const Vector3& point) const {
    const Cell low = cell_of(point - Vector3::Constant(tolerance_));
    const Cell high = cell_of(point + Vector3::Constant(tolerance_));
    int best = -1;
    double least = tolerance_ * tolerance_;
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const auto cell = cells_.find({x, y, z});
          for (int i = cell == cells_.end() ? -1 : cell->second; i >= 0;
               i = next_in_cell_[static_cast<std::size_t>(i)]) {
            const double squared = (points_.col(i) - point).squaredNorm();
            if (squared < least || (squared == least && (best < 0 || i < best))) {
              least = squared;
              best = i;
            }
          }
        }
      }
    }
    return best;
  }

  int keep(const Vector3& point, const Cell& cell) {
    const auto [entry, is_new] = cells_.try_emplace(cell, count_);
    next_in_cell_.push_back(is_new ? -1 : entry->second);
    entry->second = count_;
    points_.col(count_) = point;
    return count_++;
  }

  double tolerance_;
  Points points_;
  int count_ = 0;
  std::unordered_map<Cell, int, CellHash> cells_;  // the last point kept in each
  std::vector<int> next_in_cell_;
};

}  // namespace

WeldedSurface welded(const FileSurface& surface, double unit, double tolerance) {
  require_surface(surface);
  std::vector<bool> named(surface.points.size(), false);
  for (const auto& triangle : surface.triangles) {
    for (const std::int64_t v : triangle) {
      named[static_cast<std::size_t>(v)] = true;
    }
  }
  double farthest = 0;
  for (std::size_t v = 0; v < named.size(); ++v) {
    farthest = named[v] ? std::max(farthest, surface.points[v].lpNorm<Eigen::Infinity>() * unit) : farthest;
  }
  constexpr double kCountable = 1e-15;  // cells are numbered by integers of 64 bits
  tolerance = tolerance > 0 ? std::max(tolerance, kCountable * farthest) : 0.0;

  KeptPoints kept(std::count(named.begin(), named.end(), true), tolerance);
  std::vector<int> number(named.size(), -1);
  WeldedSurface result;
  for (std::size_t v = 0; v < named.size(); ++v) {
    if (!named[v]) {
      ++result.unreferenced;
      continue;
    }
    const int before = kept.count();
    number[v] = kept.add(surface.points[v] * unit);
    result.welded += kept.count() == before ? 1 : 0;
  }
  result.points = kept.points();
  result.triangles.resize(3, static_cast<Index>(surface.triangles.size()));
  Index count = 0;
  for (const auto& triangle : surface.triangles) {
    const Eigen::Vector3i face(number[static_cast<std::size_t>(triangle[0])],
                               number[static_cast<std::size_t>(triangle[1])],
                               number[static_cast<std::size_t>(triangle[2])]);
    if (face(0) == face(1) || face(1) == face(2) || face(2) == face(0)) {
      ++result.collapsed_faces;
    } else {
      result.triangles.col(count++) = face;
    }
  }
  result.triangles.conservativeResize(3, count);
  return result;
}

Triangles without_duplicates(const Triangles& triangles, std::vector<bool>& copied) {
  struct Entry {
    std::array<int, 3> sorted;
    bool even;  // the corners are an even permutation of the sorted ones
    Index face;
  };
  std::vector<Entry> entries(static_cast<std::size_t>(triangles.cols()));
  for (Index f = 0; f < triangles.cols(); ++f) {
    const int a = triangles(0, f);
    const int b = triangles(1, f);
    const int c = triangles(2, f);
    Entry& entry = entries[static_cast<std::size_t>(f)];
    entry = {{a, b, c}, (a < b) + (b < c) + (c < a) == 2, f};
    std::sort(entry.sorted.begin(), entry.sorted.end());
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& e, const Entry& g) {
    return e.sorted != g.sorted ? e.sorted < g.sorted : e.face < g.face;
  });
  std::vector<bool> is_kept(entries.size(), false);
  std::vector<bool> has_copy(entries.size(), false);
  const Entry* first = nullptr;
  for (const Entry& entry : entries) {
    if (first == nullptr || first->sorted != entry.sorted) {
      first = &entry;
      is_kept[static_cast<std::size_t>(entry.face)] = true;
    } else if (entry.even != first->even) {
      has_copy[static_cast<std::size_t>(first->face)] = true;
    }
  }
  copied.clear();
  return faces_where(triangles, [&](Index f) {
    const auto face = static_cast<std::size_t>(f);
    if (is_kept[face]) {
      copied.push_back(has_copy[face]);
    }
    return is_kept[face];
  });
}

}  // namespace touchfield
