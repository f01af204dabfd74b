#include "sim/mesh/cut/cap_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "sim/core/errors.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

constexpr double kGrowth = 0.3;        // of the edge length with the distance from the rim
constexpr double kLargeCircle = 0.72;  // of the wanted length: a face with a larger circumcircle is split
constexpr double kApart = 0.6;         // of the wanted length: the least distance between points
constexpr double kOffRim = 0.45;       // the same to the edges of the rim

std::pair<Eigen::Vector2d, Eigen::Vector2d> box_of(const std::vector<Vector3>& points,
                                                   const std::vector<std::vector<int>>& loops, const CapChart& chart) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector2d lower = Eigen::Vector2d::Constant(kInfinity);
  Eigen::Vector2d upper = -lower;
  for (const std::vector<int>& loop : loops) {
    for (const int v : loop) {
      const Eigen::Vector2d p = chart.to_plane(points[static_cast<std::size_t>(v)]);
      lower = lower.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
  }
  return {lower, upper};
}

double distance_to_segment(const Vector3& x, const Vector3& a, const Vector3& b) {
  const Vector3 along = b - a;
  const double share = std::clamp((x - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + share * along - x).norm();
}

}  // namespace

CapMesh::CapMesh(const std::vector<Vector3>& points, const std::vector<std::vector<int>>& loops, CapChart chart)
    : chart_(std::move(chart)),
      mesh_([&] {
        const auto [lower, upper] = box_of(points, loops, chart_);
        return ConstrainedDelaunay(lower, upper);
      }()),
      places_(3, Vector3::Zero()),
      wanted_(3, 0.0),
      on_surface_(3),
      region_of_loop_(loops.size(), -1) {
  std::vector<std::vector<int>> numbers(loops.size());
  for (std::size_t l = 0; l < loops.size(); ++l) {
    for (const int v : loops[l]) {
      const Vector3& place = points[at(v)];
      const int number = mesh_.add(chart_.to_plane(place));
      if (number == static_cast<int>(places_.size())) {
        places_.push_back(place);
        wanted_.push_back(0);
        on_surface_.emplace_back();
      }
      on_surface_[at(number)].push_back(v);
      numbers[l].push_back(number);
    }
  }
  first_added_ = mesh_.point_count();
  for (std::size_t l = 0; l < loops.size(); ++l) {
    for (std::size_t i = 0; i < loops[l].size(); ++i) {
      const std::size_t j = (i + 1) % loops[l].size();
      mesh_.fix(numbers[l][i], numbers[l][j], static_cast<int>(rim_.size()));
      rim_.push_back({loops[l][i], loops[l][j], l});
    }
  }
  number_regions();
  measure_rim();
}

/// From the outermost face inwards: the winding number rises by one where a loop is crossed from its right.
void CapMesh::number_regions() {
  const int faces = mesh_.side_count() / 3;
  constexpr int kUnknown = std::numeric_limits<int>::min();
  std::vector<int> winding(at(faces), kUnknown);
  region_.assign(at(faces), -1);
  region_count_ = 0;
  std::vector<int> open;
  const auto visit = [&](int face, int turns) {
    if (winding[at(face)] == kUnknown) {
      winding[at(face)] = turns;
      open.push_back(face);
    }
    if (winding[at(face)] != turns || turns < 0 || turns > 1) {
      throw InputError("mesh: the edges of a cut do not bound an inside: the surface cuts itself there");
    }
  };
  const auto walk = [&](bool within_region) {
    while (!open.empty()) {
      const int face = open.back();
      open.pop_back();
      for (int side = 3 * face; side < 3 * face + 3; ++side) {
        const int twin = mesh_.twin(side);
        if (twin < 0 || (within_region && mesh_.fixed(side))) {
          continue;
        }
        if (!within_region) {
          visit(twin / 3, winding[at(face)] - (mesh_.run(side) >= 0 ? 1 : 0) + (mesh_.run(twin) >= 0 ? 1 : 0));
        } else if (region_[at(twin / 3)] < 0) {
          region_[at(twin / 3)] = region_[at(face)];
          open.push_back(twin / 3);
        }
      }
    }
  };
  visit(mesh_.first_around(0) / 3, 0);
  walk(false);
  // In the order of the loops, so that the numbers stay when points are added. A loop that passes one place twice may
  // have several parts to its left: they count as one region, and so do those of loops that share a part.
  std::vector<int> beside;  // sides along the loops, in order of their runs
  beside.resize(rim_.size());
  for (int side = 0; side < mesh_.side_count(); ++side) {
    if (mesh_.run(side) >= 0) {
      beside[at(mesh_.run(side))] = side;
    }
  }
  int parts = 0;
  for (const int side : beside) {
    if (region_[at(side / 3)] < 0) {
      region_[at(side / 3)] = parts++;
      open.push_back(side / 3);
      walk(true);
    }
  }
  DisjointSets sets(parts);
  std::vector<int> part_of_loop(region_of_loop_.size(), -1);
  for (std::size_t i = 0; i < rim_.size(); ++i) {
    const int part = region_[at(beside[i] / 3)];
    int& first = part_of_loop[rim_[i].loop];
    first = first < 0 ? part : first;
    sets.join(first, part);
  }
  std::vector<int> number(at(parts), -1);
  for (std::size_t l = 0; l < region_of_loop_.size(); ++l) {
    int& region = number[static_cast<std::size_t>(sets.root(part_of_loop[l]))];
    region = region < 0 ? region_count_++ : region;
    region_of_loop_[l] = region;
  }
  for (int& region : region_) {
    region = region < 0 ? region : number[static_cast<std::size_t>(sets.root(region))];
  }
}

/// The wanted length at a point of the rim is the mean length of the rim's edges near it.
void CapMesh::measure_rim() {
  std::vector<double> count(wanted_.size(), 0);
  std::vector<std::pair<int, int>> ends;
  for (int side = 0; side < mesh_.side_count(); ++side) {
    if (mesh_.run(side) >= 0) {
      ends.emplace_back(mesh_.from(side), mesh_.to(side));
    }
  }
  for (const auto& [a, b] : ends) {
    const double length = (places_[at(a)] - places_[at(b)]).norm();
    for (const int end : {a, b}) {
      wanted_[at(end)] += length;
      count[at(end)] += 1;
    }
  }
  std::vector<double> mean(wanted_.size(), 0);
  for (std::size_t i = 0; i < mean.size(); ++i) {
    mean[i] = wanted_[i] / std::max(count[i], 1.0);
  }
  wanted_ = mean;
  for (const auto& [a, b] : ends) {
    wanted_[at(a)] += mean[at(b)];
    wanted_[at(b)] += mean[at(a)];
  }
  for (std::size_t i = 0; i < mean.size(); ++i) {
    wanted_[i] /= 1 + count[i];
  }
}

/// Adds a point unless it is outside of the region or too near to others.
bool CapMesh::insert(const Eigen::Vector2d& p, int start, const std::function<double(const Vector3&)>& edge) {
  const int face = p.allFinite() && mesh_.holds(p) ? mesh_.face_of(p, start) : -1;
  if (face < 0) {
    return false;
  }
  const Vector3 x = chart_.to_space(p);
  const std::vector<int> faces = mesh_.cavity(p, face);
  double least = 0;
  double most = std::numeric_limits<double>::infinity();
  double to_point = most;
  double to_rim = most;
  for (const int f : faces) {
    for (int side = 3 * f; side < 3 * f + 3; ++side) {
      const Vector3& a = places_[at(mesh_.from(side))];
      const double distance = (a - x).norm();
      to_point = std::min(to_point, distance);
      least = std::max(least, wanted_[at(mesh_.from(side))] - kGrowth * distance);
      most = std::min(most, wanted_[at(mesh_.from(side))] + kGrowth * distance);
      if (mesh_.fixed(side)) {
        to_rim = std::min(to_rim, distance_to_segment(x, a, places_[at(mesh_.to(side))]));
      }
    }
  }
  const double wanted = std::min(std::max(edge(x), least), most);
  if (to_point < kApart * wanted || to_rim < kOffRim * wanted || mesh_.add(p) < static_cast<int>(places_.size())) {
    return false;
  }
  places_.push_back(x);
  wanted_.push_back(wanted);
  on_surface_.emplace_back();
  return true;
}

/// A first row of nearly equilateral faces along the rim.
void CapMesh::line_rim(const std::vector<bool>& regions, const std::function<double(const Vector3&)>& edge) {
  std::vector<std::pair<int, int>> ends;
  for (int side = 0; side < mesh_.side_count(); ++side) {
    if (mesh_.run(side) >= 0 && regions[at(region_[at(side / 3)])]) {
      ends.emplace_back(mesh_.from(side), mesh_.to(side));
    }
  }
  for (const auto& [a, b] : ends) {
    const int side = mesh_.side_between(a, b);
    const Eigen::Vector2d start = chart_.to_plane(places_[at(a)]);
    const Eigen::Vector2d along = chart_.to_plane(places_[at(b)]) - start;
    const double length = (places_[at(a)] - places_[at(b)]).norm();
    const double height = std::sqrt(0.75) * 0.5 * (wanted_[at(a)] + wanted_[at(b)]) / length;
    insert(start + 0.5 * along + height * Eigen::Vector2d(-along.y(), along.x()), side / 3, edge);
  }
}

bool CapMesh::split_large_faces(const std::vector<bool>& regions, const std::function<double(const Vector3&)>& edge) {
  struct Candidate {
    double excess;
    int face;
    std::array<int, 3> corners;
    Eigen::Vector2d centre;
  };
  std::vector<Candidate> candidates;
  for (int face = 0; face < mesh_.side_count() / 3; ++face) {
    if (region_[at(face)] < 0 || !regions[at(region_[at(face)])]) {
      continue;
    }
    const std::array<int, 3> corners = {mesh_.from(3 * face), mesh_.from(3 * face + 1), mesh_.from(3 * face + 2)};
    const Vector3& a = places_[at(corners[0])];
    const Vector3 ab = places_[at(corners[1])] - a;
    const Vector3 ac = places_[at(corners[2])] - a;
    const Vector3 normal = ab.cross(ac);
    const Vector3 to_centre =
        (ab.squaredNorm() * ac.cross(normal) + ac.squaredNorm() * normal.cross(ab)) / (2 * normal.squaredNorm());
    const double wanted = (wanted_[at(corners[0])] + wanted_[at(corners[1])] + wanted_[at(corners[2])]) / 3;
    const double radius = to_centre.norm();
    const double reach = kGrowth * radius;
    const double limit = kLargeCircle * std::clamp(edge(a + to_centre), wanted - reach, wanted + reach);
    if (!(radius < limit)) {
      // The centre on the sphere lies on the normal through the centre in the face's plane.
      candidates.push_back(
          {radius / limit, face, corners, chart_.to_plane(a + to_centre + chart_.radius * normal.normalized())});
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& s, const Candidate& t) {
    return s.excess != t.excess ? s.excess > t.excess : s.face < t.face;
  });
  bool changed = false;
  for (const Candidate& candidate : candidates) {
    const int first = 3 * candidate.face;
    if (candidate.corners == std::array<int, 3>{mesh_.from(first), mesh_.from(first + 1), mesh_.from(first + 2)}) {
      changed = insert(candidate.centre, candidate.face, edge) || changed;
    }
  }
  return changed;
}

/// Moves every point that was added to the middle of its neighbours.
void CapMesh::smooth() {
  for (int point = first_added_; point < mesh_.point_count(); ++point) {
    Vector3 mean = Vector3::Zero();
    double weight = 0;
    const int first = mesh_.first_around(point);
    int side = first;
    do {
      mean += places_[at(mesh_.to(side))];
      weight += 1;
      side = mesh_.next_clockwise(side);
    } while (side != first);
    const Eigen::Vector2d p = chart_.to_plane(mean / weight);
    if (mesh_.holds(p) && mesh_.move(point, p)) {
      places_[at(point)] = chart_.to_space(p);
    }
  }
  mesh_.restore();
}

void CapMesh::refine(const std::vector<bool>& regions, const std::function<double(const Vector3&)>& edge) {
  constexpr int kRounds = 60;  // of splitting; the last ones find little
  constexpr int kSmoothings = 6;
  line_rim(regions, edge);
  number_regions();
  for (int i = 0; i < kRounds && split_large_faces(regions, edge); ++i) {
    number_regions();
  }
  for (int i = 0; i < kSmoothings; ++i) {
    smooth();
  }
  number_regions();
}

/// The surface's point at the start of a side; those that were added follow its first `count`. Where several share a
/// place, it is that of the fan of faces that the side's face is in, which the next run clockwise begins.
int CapMesh::surface_point(int side, int count) const {
  const int point = mesh_.from(side);
  if (point >= first_added_) {
    return count + point - first_added_;
  }
  if (on_surface_[at(point)].size() == 1) {
    return on_surface_[at(point)][0];
  }
  while (mesh_.run(side) < 0) {
    side = mesh_.next_clockwise(side);
  }
  return rim_[at(mesh_.run(side))].from;
}

void CapMesh::append(const std::vector<bool>& regions, std::vector<Vector3>& points,
                     std::vector<std::array<int, 3>>& triangles) const {
  const int count = static_cast<int>(points.size());
  points.insert(points.end(), places_.begin() + first_added_, places_.end());
  for (int face = 0; face < mesh_.side_count() / 3; ++face) {
    if (region_[at(face)] >= 0 && regions[at(region_[at(face)])]) {
      triangles.push_back(
          {surface_point(3 * face, count), surface_point(3 * face + 1, count), surface_point(3 * face + 2, count)});
    }
  }
}

}  // namespace touchfield
