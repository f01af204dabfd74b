#include "sim/field/target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/field/target_parts.h"
#include "sim/mesh/query/inspect.h"

namespace touchfield {

namespace {

double distance_to(const TargetBox& box, const Vector3& x) {
  const Vector3 own = in_box_frame(box, x).cwiseAbs();
  if (box.shape == TargetShape::kCylinder) {
    const double beside = std::max(own.head<2>().norm() - 0.5 * box.size.x(), 0.0);
    return std::hypot(beside, std::max(own.z() - 0.5 * box.size.z(), 0.0));
  }
  return (own - 0.5 * box.size).cwiseMax(0.0).norm();
}

/// What messages call the part that a box belongs to.
std::string part_key(const std::vector<TargetBox>& boxes, std::size_t index) {
  if (!boxes[index].key.empty()) {
    return boxes[index].key;
  }
  return boxes.size() == 1 ? "target.box" : fmt::format("target.boxes[{}]", index);
}

/// Ends of the runs of boxes that are one part.
std::vector<std::size_t> part_ends(const std::vector<TargetBox>& boxes) {
  std::vector<std::size_t> ends;
  for (std::size_t b = 1; b <= boxes.size(); ++b) {
    if (b == boxes.size() || boxes[b].key.empty() || boxes[b].key != boxes[b - 1].key) {
      ends.push_back(b);
    }
  }
  return ends;
}

/// Whether the boxes begin to end hold, of these parts of faces, as much as half a face.
bool hold_enough(const TriangleMesh& mesh, const std::vector<FacePart>& parts, std::size_t begin, std::size_t end) {
  constexpr double kLeast = 0.5;  // of a face
  double area = 0.0;
  double faces = 0.0;
  double count = 0.0;
  for (const FacePart& part : parts) {
    if (static_cast<std::size_t>(part.box) >= begin && static_cast<std::size_t>(part.box) < end) {
      area += part.area;
      faces += mesh.areas()(part.face);
      count += 1.0;
    }
  }
  return count > 0 && area >= kLeast * faces / count;
}

/// No skin is in the boxes of a part, begin to end.
[[noreturn]] void refuse_empty_part(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, std::size_t begin,
                                    std::size_t end) {
  double nearest = std::numeric_limits<double>::infinity();
  Eigen::Index face = 0;
  std::size_t box = begin;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (std::size_t b = begin; b < end; ++b) {
      if (const double distance = distance_to(boxes[b], mesh.centroids().col(f)); distance < nearest) {
        nearest = distance;
        face = f;
        box = b;
      }
    }
  }
  const auto at = [&](std::size_t i) { return boxes.begin() + static_cast<std::ptrdiff_t>(i); };
  require(!hold_faces(mesh, {at(begin), at(end)}),
          "{}: the parts of the target before it hold its skin about {} (scene coordinates), and a face belongs to the "
          "first part that holds it; leave one out, or make the first smaller",
          part_key(boxes, begin), place_text(boxes[begin].centre));
  throw InputError(
      fmt::format("{}: the box about {} (scene coordinates) holds no skin, or less than half a face; the nearest "
                  "centroid of a face "
                  "is {:.2f} mm outside the box, at {}",
                  part_key(boxes, box), place_text(boxes[box].centre), nearest / kMillimetre,
                  place_text(mesh.centroids().col(face))));
}

[[noreturn]] void refuse_whole_body(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const Vector3 size = (mesh.vertices().rowwise().maxCoeff() - mesh.vertices().rowwise().minCoeff()) / kMillimetre;
  throw InputError(fmt::format("{} covers the whole body ({:.3g} x {:.3g} x {:.3g} mm); make it smaller",
                               part_ends(boxes).size() == 1 ? part_key(boxes, 0) : "target", size.x(), size.y(),
                               size.z()));
}

/// Depth of points in a box below that face of it through which the skin enters [m].
class Penetration {
 public:
  Penetration(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const std::vector<FacePart>& parts)
      : boxes_(boxes), normal_sum_(boxes.size(), 0.0) {
    for (const FacePart& part : parts) {
      normal_sum_[index(part)] += part.area * boxes[index(part)].rotation.col(2).dot(mesh.normals().col(part.face));
    }
  }

  double depth(const FacePart& part, const Vector3& x) const {
    const TargetBox& box = boxes_[index(part)];
    const double along = in_box_frame(box, x).z();
    // Skin that faces down the axis came in from above.
    return 0.5 * box.size.z() + (normal_sum_[index(part)] <= 0 ? -along : along);
  }

  double deepest(const std::vector<FacePart>& parts) const {
    double most = 0.0;
    for (const FacePart& part : parts) {
      for (const Vector3& corner : part.corners) {
        most = std::max(most, depth(part, corner));
      }
    }
    return most;
  }

 private:
  static std::size_t index(const FacePart& part) { return static_cast<std::size_t>(part.box); }

  const std::vector<TargetBox>& boxes_;
  std::vector<double> normal_sum_;
};

void add_face(const TriangleMesh& mesh, std::span<const FacePart> parts, std::span<const double> wanted,
              Target& target) {
  double area = 0.0;
  double excess = 0.0;  // over what the first part wants, which all have in a uniform target
  for (std::size_t i = 0; i < parts.size(); ++i) {
    area += parts[i].area;
    excess += parts[i].area * (wanted[i] - wanted.front());
  }
  const auto k = static_cast<Eigen::Index>(target.faces.size());
  target.faces.push_back(parts.front().face);
  target.box.push_back(std::ranges::max_element(parts, {}, &FacePart::area)->box);
  target.amplitudes(k) = wanted.front() + excess / area;
  const double share = area / mesh.areas()(parts.front().face);
  target.shares(k) = share < 1.0 - kLeastPart ? share : 1.0;
}

/// A part of `along` that is normal to `z`, of length 1.
Vector3 made_tangent(const Vector3& along, const Vector3& z) { return (along - along.dot(z) * z).normalized(); }

/// But for rounding, of lengths of a body.
bool is_same(const Vector3& a, const Vector3& b) { return (a - b).norm() < 1e-9; }

constexpr double kSharp = 0.5;  // [rad], bends from which on a corner would stick out

double bend(const Vector3& before, const Vector3& after) { return std::acos(std::clamp(before.dot(after), -1.0, 1.0)); }

/// By how much two pieces that meet have to be longer so that their outer corners meet, if the bend is not sharp.
double mitre(const Vector3& before, const Vector3& after, double width) {
  constexpr double kOverlap = 0.05;  // of the width, of pieces in line: rounding leaves no gap
  const double angle = bend(before, after);
  return (angle < kSharp ? 0.5 * std::tan(0.5 * angle) + kOverlap : kOverlap) * width;
}

}  // namespace

bool hold_faces(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const std::vector<FacePart> parts = face_parts(mesh, boxes);
  std::size_t begin = 0;
  return std::ranges::all_of(part_ends(boxes),
                             [&](std::size_t end) { return hold_enough(mesh, parts, std::exchange(begin, end), end); });
}

Target make_target(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, TargetProfile profile,
                   double pressure, TargetQuantity levels_of) {
  require(pressure > 0 && std::isfinite(pressure), "target: pressure = {} Pa must be > 0", pressure);
  const std::vector<FacePart> parts = face_parts(mesh, boxes);
  std::size_t begin = 0;
  for (const std::size_t end : part_ends(boxes)) {
    if (!hold_enough(mesh, parts, begin, end)) {
      refuse_empty_part(mesh, boxes, begin, end);
    }
    begin = end;
  }
  const bool penetrates = profile == TargetProfile::kPenetration;
  const Penetration penetration(mesh, boxes, parts);
  const double deepest = penetrates ? penetration.deepest(parts) : 1.0;
  const bool of_radiation = levels_of == TargetQuantity::kRadiation;
  const double largest = of_radiation ? pressure * pressure : pressure;  // P' over its factor
  std::vector<double> wanted;
  for (const FacePart& part : parts) {
    const TargetBox& box = boxes[static_cast<std::size_t>(part.box)];
    const double level = box.mask ? level_at(box, part.centroid) : box.level;
    wanted.push_back(largest * level * (penetrates ? penetration.depth(part, part.centroid) / deepest : 1.0));
  }
  Target target;
  target.boxes = boxes;
  target.amplitudes.resize(static_cast<Eigen::Index>(parts.size()));
  target.shares.resize(static_cast<Eigen::Index>(parts.size()));
  for (std::size_t i = 0; i < parts.size();) {
    std::size_t next = i;
    while (next < parts.size() && parts[next].face == parts[i].face) {
      ++next;
    }
    add_face(mesh, std::span(parts).subspan(i, next - i), std::span(wanted).subspan(i, next - i), target);
    i = next;
  }
  target.amplitudes.conservativeResize(target.size());
  if (of_radiation) {
    target.amplitudes = target.amplitudes.cwiseSqrt().eval();
  }
  target.shares.conservativeResize(target.size());
  if (target.size() == mesh.face_count() && (target.shares.array() == 1.0).all()) {
    refuse_whole_body(mesh, boxes);
  }
  return target;
}

OppositeSides opposite_sides(const TriangleMesh& mesh, const Target& target) {
  constexpr double kOpposite = -0.8;  // of the normals
  OppositeSides sides{0.0, 0.0, Vector3::Zero()};
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  double opposed = 0.0;
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    const Eigen::Index f = target.faces[i];
    const double area = areas(static_cast<Eigen::Index>(i));
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < target.faces.size(); ++j) {
      const Eigen::Index g = target.faces[j];
      if (target.box[i] == target.box[j] && mesh.normals().col(f).dot(mesh.normals().col(g)) < kOpposite &&
          facing(mesh, f, g) == Facing::kThroughBody) {
        nearest = std::min(nearest, (mesh.centroids().col(g) - mesh.centroids().col(f)).norm());
      }
    }
    if (std::isfinite(nearest)) {
      sides.at = opposed == 0.0 ? Vector3(mesh.centroids().col(f)) : sides.at;
      opposed += area;
      sides.thickness += area * nearest;
    }
  }
  if (opposed > 0.0) {
    sides.share = opposed / areas.sum();
    sides.thickness /= opposed;
  }
  return sides;
}

Eigen::Index central_face(const TriangleMesh& mesh, const Target& target) {
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  const Vector3 centre = mesh.centroids()(Eigen::all, target.faces) * areas / areas.sum();
  return *std::min_element(target.faces.begin(), target.faces.end(), [&](Eigen::Index a, Eigen::Index b) {
    return (mesh.centroids().col(a) - centre).squaredNorm() < (mesh.centroids().col(b) - centre).squaredNorm();
  });
}

Vector3 SkinStrokes::normal_about(const Vector3& x, double radius) const {
  const Eigen::Index own = tree_.nearest(x).face;
  Vector3 sum = mesh_.areas()(own) * mesh_.normals().col(own);
  std::vector<Eigen::Index> near;
  tree_.centroids_within(x, radius, near);
  for (const Eigen::Index face : near) {
    if (mesh_.normals().col(face).dot(mesh_.normals().col(own)) > 0) {
      sum += mesh_.areas()(face) * mesh_.normals().col(face);
    }
  }
  return sum.normalized();
}

SkinPoint SkinStrokes::on_skin(const Vector3& at, const std::string& key) const {
  const SkinPoint found = tree_.nearest(at);
  if (found.distance <= reach_) {
    return found;
  }
  constexpr double kThousand =
      1e3;  // metres taken for millimetres, or millimetres for metres where they are 1 m and more
  const auto fits = [&](double factor) { return tree_.nearest(factor * at).distance <= reach_; };
  const char* unit = fits(kThousand)                          ? "; a thousand times these coordinates are on it"
                     : at.norm() > 1 && fits(1.0 / kThousand) ? "; a thousandth of these coordinates is on it"
                                                              : "";
  throw InputError(
      fmt::format("{}: {} (scene coordinates) is {:.1f} mm off the skin, must be at most {:g}; the nearest skin "
                  "is at {}{}",
                  key, place_text(at, at.norm() < kReach ? 3 : 1), found.distance / kMillimetre, reach_ / kMillimetre,
                  place_text(found.at), unit));
}

TargetBox SkinStrokes::disc(const Vector3& at, double diameter, double level, const std::string& key) const {
  const Vector3 centre = on_skin(at, key).at;
  Eigen::Matrix3d axes;
  axes.col(2) = normal_about(centre, 0.5 * diameter);
  const bool along_x = std::abs(axes(0, 2)) > std::abs(axes(1, 2));  // the normal: then the width is along y
  axes.col(0) = made_tangent(along_x ? Vector3::UnitY() : Vector3::UnitX(), axes.col(2));
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return {centre, {diameter, diameter, kDepth}, axes, TargetShape::kCylinder, level, key};
}

/// The skin between two points of it: on their side of a finger, though the middle may lie nearer to the other.
SkinPoint SkinStrokes::middle_of(const SkinPoint& from, const SkinPoint& to) const {
  constexpr double kOneSide = 0.5;  // length of the sum of the normals, below which the points look apart
  constexpr double kFacing = 0.3;   // cosine
  const Vector3 middle = 0.5 * (from.at + to.at);
  const Vector3 facing = mesh_.normals().col(from.face) + mesh_.normals().col(to.face);
  if (facing.norm() > kOneSide) {
    const SkinPoint found = tree_.nearest_facing(middle, facing.normalized(), kFacing);
    return found.face >= 0 ? found : tree_.nearest(middle);
  }
  return tree_.nearest(middle);
}

/// Adds the points of the skin from the last of `nodes` to `to`, without the former.
void SkinStrokes::add_nodes(const SkinPoint& to, double longest, const std::string& key,
                            std::vector<SkinPoint>& nodes) const {
  constexpr double kShorter = 0.95;  // each half is this much of the whole, or else there is a gap in the skin
  const SkinPoint from = nodes.back();
  const double length = (to.at - from.at).norm();
  if (length <= longest) {
    require(nodes.size() <= kMost, "{}: needs more than {} pieces of {:.3g} mm; make it wider or shorter", key, kMost,
            longest / kMillimetre);
    nodes.push_back(to);
    return;
  }
  const SkinPoint middle = middle_of(from, to);
  require(std::max((middle.at - from.at).norm(), (to.at - middle.at).norm()) <= kShorter * length,
          "{}: no skin leads from {} to {} (scene coordinates), {:.1f} mm apart; give points between them", key,
          place_text(from.at), place_text(to.at), length / kMillimetre);
  add_nodes(middle, longest, key, nodes);
  add_nodes(to, longest, key, nodes);
}

std::vector<TargetBox> SkinStrokes::strip(const std::vector<Vector3>& points, double width, double level,
                                          const std::string& key) const {
  const auto place = [&](std::size_t i) { return on_skin(points[i], fmt::format("{}: points[{}]", key, i)); };
  std::vector<SkinPoint> places = {place(0)};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const SkinPoint next = place(i);
    require(!is_same(next.at, places.back().at), "{}: points[{}] and points[{}] are at the same place of the skin, {}",
            key, i - 1, i, place_text(next.at));
    add_nodes(next, std::min(width, kLongest), key, places);
  }
  std::vector<Vector3> nodes;
  std::ranges::transform(places, std::back_inserter(nodes), &SkinPoint::at);
  const std::size_t count = nodes.size() - 1;
  const bool closed = count > 2 && is_same(nodes.front(), nodes.back());
  std::vector<Vector3> along(count);
  for (std::size_t i = 0; i < count; ++i) {
    along[i] = (nodes[i + 1] - nodes[i]).normalized();
  }
  const auto is_inner = [&](std::size_t node) { return closed || (node > 0 && node < count); };
  const auto before = [&](std::size_t node) -> const Vector3& { return node > 0 ? along[node - 1] : along.back(); };
  const auto behind = [&](std::size_t node) -> const Vector3& { return node < count ? along[node] : along.front(); };
  const auto beyond = [&](std::size_t node) { return is_inner(node) ? mitre(before(node), behind(node), width) : 0.0; };
  std::vector<TargetBox> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3 middle = 0.5 * (nodes[i] + nodes[i + 1]);
    Eigen::Matrix3d axes;
    axes.col(1) = along[i];
    axes.col(2) = made_tangent(normal_about(middle, 0.5 * width), along[i]);
    axes.col(0) = axes.col(1).cross(axes.col(2));
    const double first = beyond(i);
    const double last = beyond(i + 1);
    const double length = (nodes[i + 1] - nodes[i]).norm() + first + last;
    boxes.push_back(
        {middle + 0.5 * (last - first) * along[i], {width, length, kDepth}, axes, TargetShape::kBox, level, key});
  }
  for (std::size_t node = 0; node < count; ++node) {
    if (is_inner(node) && bend(before(node), behind(node)) >= kSharp) {
      boxes.push_back(disc(nodes[node], width, level, key));
    }
  }
  return boxes;
}

TargetBox masked_box(const TriangleMesh& surface, const std::vector<double>& levels, const std::string& key) {
  std::vector<Eigen::Index> faces;
  Vector3 normal = Vector3::Zero();
  for (Eigen::Index f = 0; f < surface.face_count(); ++f) {
    if (levels[static_cast<std::size_t>(f)] > 0) {
      faces.push_back(f);
      normal += surface.areas()(f) * surface.normals().col(f);
    }
  }
  const Eigen::VectorXd weights = surface.areas()(faces) / surface.areas()(faces).sum();
  const Points places = surface.centroids()(Eigen::all, faces);
  const Points from = places.colwise() - Vector3(places * weights);
  // A mask all round a body has no mean normal to speak of: then any direction will do.
  normal = normal.norm() > 0 ? normal.normalized() : Vector3::UnitZ();
  const Points beside = from - normal * (normal.transpose() * from);
  const Eigen::Matrix3d spread = beside * weights.asDiagonal() * beside.transpose() + normal * normal.transpose();
  Eigen::Matrix3d axes;
  axes.col(2) = normal;  // of the largest eigenvalue, 1 m2
  axes.col(0) = made_tangent(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0), normal);
  axes.col(1) = axes.col(2).cross(axes.col(0));
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Index f : faces) {
    for (int c = 0; c < 3; ++c) {
      bounds.extend(Vector3(axes.transpose() * surface.corner(f, c)));
    }
  }
  const Vector3 centre = axes * bounds.center();
  const TriangleMesh own = transformed(surface, axes.transpose(), -axes.transpose() * centre);
  return {centre,
          bounds.sizes() + 2.0 * SkinMask::kReach * Vector3::UnitZ(),
          axes,
          TargetShape::kMask,
          1.0,
          key,
          std::make_shared<SkinMask>(own, levels)};
}

std::vector<Vector3> masked_places(const TriangleMesh& surface, const std::vector<double>& levels) {
  std::map<std::array<std::int64_t, 3>, Vector3> places;
  for (Eigen::Index f = 0; f < surface.face_count(); ++f) {
    if (levels[static_cast<std::size_t>(f)] > 0) {
      const Vector3 at = surface.centroids().col(f);
      const auto cell = [&](int axis) { return std::llround(at[axis] / SkinStrokes::kLongest); };
      places.emplace(std::array<std::int64_t, 3>{cell(0), cell(1), cell(2)}, at);
    }
  }
  std::vector<Vector3> all;
  std::ranges::transform(places, std::back_inserter(all), [](const auto& place) { return place.second; });
  return all;
}

}  // namespace touchfield
