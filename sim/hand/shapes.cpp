#include "sim/hand/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using std::numbers::pi;

constexpr double kMostFaces = 5e6;  // half a gigabyte of mesh; more is a slip of the unit

void require_positive(const char* field, double value) {
  require(value > 0 && std::isfinite(value), "{} = {} m must be > 0 and finite", field, value);
}

double faces_of_edge(double area, double edge) { return area / (std::sqrt(3.0) / 4.0 * edge * edge); }

/// edge [m] must not ask for more faces than any machine takes.
void require_faces(const char* shape, double edge, double faces, double most = kMostFaces) {
  if (!(faces <= most)) {
    throw InputError(
        fmt::format("{}: edges of {} m would take {:.1e} faces; at most {:.0e}", shape, edge, faces, most));
  }
}

/// The six landmarks of a body about the origin: its outermost points along the axes.
std::vector<Landmark> axis_landmarks(const TriangleMesh& mesh, const Vector3& reach) {
  std::vector<Landmark> landmarks;
  for (const std::string& name : shape_landmark_names()) {
    const int axis = name.starts_with('x') ? 0 : name.starts_with('y') ? 1 : 2;
    const bool upper = name == "top" || name.ends_with("plus");
    landmarks.push_back(nearest_landmark(mesh, name, (upper ? 1.0 : -1.0) * reach(axis) * Vector3::Unit(axis)));
  }
  return landmarks;
}

/// Points that several faces share, each known by a key and numbered when it is first met.
template <class Key>
class SharedPoints {
 public:
  /// The number of the point with this key; make() gives its place.
  template <class Make>
  int number(const Key& key, const Make& make) {
    const auto [entry, is_new] = numbers_.try_emplace(key, static_cast<int>(points_.size()));
    if (is_new) {
      points_.push_back(make());
    }
    return entry->second;
  }

  Points points() const { return as_columns(points_); }

 private:
  std::map<Key, int> numbers_;
  std::vector<Vector3> points_;
};

/// Unit icosahedron with a vertex at either pole of z.
std::pair<Points, Triangles> icosahedron() {
  Points vertices(3, 12);
  const double z = 1.0 / std::sqrt(5.0);
  const double ring = 2.0 / std::sqrt(5.0);
  vertices.col(0) << 0, 0, 1;
  vertices.col(11) << 0, 0, -1;
  for (int i = 0; i < 5; ++i) {
    const double upper = 2.0 * pi / 5.0 * i;
    const double lower = upper + pi / 5.0;
    vertices.col(1 + i) << ring * std::cos(upper), ring * std::sin(upper), z;
    vertices.col(6 + i) << ring * std::cos(lower), ring * std::sin(lower), -z;
  }
  Triangles faces(3, 20);
  for (int i = 0; i < 5; ++i) {
    const int next = (i + 1) % 5;
    faces.col(i) << 0, 1 + i, 1 + next;
    faces.col(5 + i) << 1 + i, 6 + i, 1 + next;
    faces.col(10 + i) << 6 + i, 6 + next, 1 + next;
    faces.col(15 + i) << 11, 6 + next, 6 + i;
  }
  return {vertices, faces};
}

/// The corners of the icosahedron that a point of its split faces lies between and its steps from each, -1 and 0 if it
/// is on the side or corner opposite to one.
using LatticeKey = std::array<std::pair<int, int>, 3>;

/// Its direction, by the weights sin(w t) in place of t, w the angle of an edge: equal arcs along the edges, and inside
/// nearly equal faces.
Vector3 direction_of(const LatticeKey& key, const Points& corners, int subdivisions) {
  const double edge_angle = std::atan(2.0);
  Vector3 sum = Vector3::Zero();
  for (const auto& [corner, steps] : key) {
    if (steps > 0) {
      sum += std::sin(edge_angle * steps / subdivisions) * corners.col(corner);
    }
  }
  return sum.normalized();
}

/// The nearest points at distance `radius` from the segment from -length/2 to length/2 on y.
Points on_capsule(const Points& points, double radius, double length) {
  Points moved(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 axis(0, std::clamp(points(1, i), -0.5 * length, 0.5 * length), 0);
    moved.col(i) = axis + radius * (points.col(i) - axis).normalized();
  }
  return moved;
}

/// Rings of equally many points about the axis from pole to pole, each turned by half a step against the last. Good on
/// the cylinder, ever thinner towards the poles.
std::pair<Points, Triangles> rings_about_capsule(double radius, double length, double edge) {
  const double row = std::sqrt(3.0) / 2.0 * edge;
  const int around = std::max(6, static_cast<int>(std::round(2.0 * pi * radius / edge)));
  const int cap_rows = std::max(2, static_cast<int>(std::round(0.5 * pi * radius / row)));
  const int side_rows = static_cast<int>(std::ceil(length / row));
  const int rings = 2 * cap_rows - 1 + side_rows;
  const int south = rings * around;
  const int north = south + 1;
  Points points(3, north + 1);
  for (int ring = 0; ring < rings; ++ring) {
    // Latitude from the south pole on the caps; the rings from cap_rows - 1 to cap_rows - 1 + side_rows are the
    // cylinder.
    const int along = std::clamp(ring - (cap_rows - 1), 0, side_rows);
    const double latitude = 0.5 * pi * (ring + 1 - along - cap_rows) / cap_rows;
    const double axis = side_rows > 0 ? length * (static_cast<double>(along) / side_rows - 0.5) : 0.0;
    for (int i = 0; i < around; ++i) {
      const double turn = 2.0 * pi * (i + 0.5 * (ring % 2)) / around;
      points.col(ring * around + i) << radius * std::cos(latitude) * std::sin(turn), axis + radius * std::sin(latitude),
          radius * std::cos(latitude) * std::cos(turn);
    }
  }
  points.col(south) << 0, -0.5 * length - radius, 0;
  points.col(north) << 0, 0.5 * length + radius, 0;

  Triangles triangles(3, 2 * rings * around);
  Eigen::Index count = 0;
  for (int i = 0; i < around; ++i) {
    const int next = (i + 1) % around;
    triangles.col(count++) << south, next, i;
    for (int ring = 0; ring + 1 < rings; ++ring) {
      const int below = ring * around;
      const int above = below + around;
      // The point of the ring above between i and next of this one is i if this ring is not turned, else next.
      const bool turned = ring % 2 == 1;
      const int between = turned ? next : i;
      triangles.col(count++) << below + i, below + next, above + between;
      if (turned) {
        triangles.col(count++) << below + i, above + next, above + i;
      } else {
        triangles.col(count++) << below + next, above + next, above + i;
      }
    }
    const int last = (rings - 1) * around;
    triangles.col(count++) << last + i, last + next, north;
  }
  return {points, triangles};
}

/// The vertices of a mesh on a capsule, put at the distance from its axis at which the volume is the capsule's.
TriangleMesh with_capsule_volume(const TriangleMesh& mesh, double radius, double length) {
  const double volume = pi * radius * radius * (4.0 / 3.0 * radius + length);
  // The volume grows by nearly the area times the distance: every step leaves a small share of the difference.
  constexpr int kMostSteps = 50;
  constexpr double kClose = 1e-12;
  TriangleMesh fitted = mesh;
  double distance = radius;
  for (int step = 0; step < kMostSteps && std::abs(fitted.signed_volume() - volume) > kClose * volume; ++step) {
    distance += (volume - fitted.signed_volume()) / fitted.total_area();
    fitted = TriangleMesh(on_capsule(mesh.vertices(), distance, length), mesh.triangles());
  }
  return fitted;
}

}  // namespace

const std::vector<std::string>& shape_landmark_names() {
  static const std::vector<std::string> kNames = {"top", "bottom", "x_plus", "x_minus", "y_plus", "y_minus"};
  return kNames;
}

TriangleMesh icosphere(double radius, int subdivisions) {
  require_positive("sphere.radius", radius);
  require(subdivisions >= 1 && 20.0 * subdivisions * subdivisions <= kMostFaces,
          "sphere.subdivisions = {} must be 1 to {}", subdivisions, static_cast<int>(std::sqrt(kMostFaces / 20.0)));
  const auto [corners, faces] = icosahedron();
  SharedPoints<LatticeKey> shared;
  Triangles triangles(3, Eigen::Index{20} * subdivisions * subdivisions);
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    // (i, j): steps along the face's first and second side.
    const auto vertex = [&, &lattice = corners, &sides = faces](int i, int j) {
      const Eigen::Vector3i steps(subdivisions - i - j, i, j);
      LatticeKey key;
      for (int c = 0; c < 3; ++c) {
        key[static_cast<std::size_t>(c)] = steps(c) > 0 ? std::pair{sides(c, f), steps(c)} : std::pair{-1, 0};
      }
      std::sort(key.begin(), key.end());
      return shared.number(key, [&] { return direction_of(key, lattice, subdivisions); });
    };
    for (int i = 0; i < subdivisions; ++i) {
      for (int j = 0; i + j < subdivisions; ++j) {
        triangles.col(count++) << vertex(i, j), vertex(i + 1, j), vertex(i, j + 1);
        if (i + j + 2 <= subdivisions) {
          triangles.col(count++) << vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1);
        }
      }
    }
  }
  const Points unit = shared.points();
  const double unit_volume = TriangleMesh(unit, triangles).signed_volume();
  return {unit * (radius * std::cbrt(4.0 / 3.0 * pi / unit_volume)), triangles};
}

Body sphere(double radius, double edge) {
  require_positive("sphere.radius", radius);
  const double area = 4.0 * pi * radius * radius;
  require_positive("sphere.edge", edge);
  require_faces("sphere", edge, faces_of_edge(area, edge));
  // The mean edge falls as 1/f but for the curvature, which matters at small f only: try the frequencies about 1/f.
  const int guess = std::max(1, static_cast<int>(std::sqrt(area / (20.0 * std::sqrt(3.0) / 4.0)) / edge));
  TriangleMesh mesh = icosphere(radius, guess);
  TriangleMesh finer = icosphere(radius, guess + 1);
  if (std::abs(finer.mean_edge() - edge) < std::abs(mesh.mean_edge() - edge)) {
    mesh = std::move(finer);
  }
  std::vector<Landmark> landmarks = axis_landmarks(mesh, Vector3::Constant(mesh.vertices().col(0).norm()));
  return {std::move(mesh), std::move(landmarks)};
}

Body capsule(double radius, double length, double edge) {
  require_positive("capsule.radius", radius);
  require(length >= 0 && std::isfinite(length), "capsule.length = {} m must be >= 0 and finite", length);
  require_positive("capsule.edge", edge);
  const double wanted = std::min(edge, radius);
  constexpr double kMostRemeshed = 1e6;  // half a minute of remeshing
  require_faces("capsule", wanted, faces_of_edge(2.0 * pi * radius * (2.0 * radius + length), wanted), kMostRemeshed);
  const auto [start, triangles] = rings_about_capsule(radius, length, wanted);
  const RemeshTarget target{
      [&](const Points& points) { return Eigen::VectorXd(Eigen::VectorXd::Constant(points.cols(), wanted)); },
      [&](Points& points) { points = on_capsule(points, radius, length); }};
  constexpr int kRounds = 10;
  TriangleMesh mesh = remeshed(start, triangles, target, kRounds);
  mesh = with_capsule_volume(mesh, radius, length);
  std::vector<Landmark> landmarks = axis_landmarks(mesh, {radius, 0.5 * length + radius, radius});
  return {std::move(mesh), std::move(landmarks)};
}

Body box(const Vector3& size, double edge) {
  const std::array<const char*, 3> fields = {"box.size[0]", "box.size[1]", "box.size[2]"};
  for (int axis = 0; axis < 3; ++axis) {
    require_positive(fields[static_cast<std::size_t>(axis)], size(axis));
  }
  require_positive("box.edge", edge);
  // Squares of this side, cut in two, have the area of equilateral triangles of side `edge`.
  const double side = edge * std::sqrt(std::sqrt(3.0) / 2.0);
  const Vector3 squares = (size / side).array().round().max(1.0);
  require_faces("box", edge, 4.0 * (squares.x() * squares.y() + squares.y() * squares.z() + squares.z() * squares.x()));
  const Eigen::Vector3i counts = squares.cast<int>();
  SharedPoints<std::array<int, 3>> lattice;
  std::vector<std::array<int, 3>> triangles;
  for (int normal = 0; normal < 3; ++normal) {
    const int u = (normal + 1) % 3;
    const int v = (normal + 2) % 3;
    for (const bool outer : {false, true}) {
      for (int i = 0; i < counts(u); ++i) {
        for (int j = 0; j < counts(v); ++j) {
          const auto vertex = [&](int step_u, int step_v) {
            Eigen::Vector3i steps;
            steps(normal) = outer ? counts(normal) : 0;
            steps(u) = i + step_u;
            steps(v) = j + step_v;
            return lattice.number({steps.x(), steps.y(), steps.z()}, [&]() -> Vector3 {
              const Vector3 share = steps.cast<double>().cwiseQuotient(counts.cast<double>());
              return size.cwiseProduct(share - Vector3::Constant(0.5));
            });
          };
          const std::array<int, 4> square = {vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1)};
          if (outer) {
            triangles.push_back({square[0], square[1], square[2]});
            triangles.push_back({square[0], square[2], square[3]});
          } else {
            triangles.push_back({square[0], square[2], square[1]});
            triangles.push_back({square[0], square[3], square[2]});
          }
        }
      }
    }
  }
  TriangleMesh mesh(lattice.points(), as_columns(triangles));
  std::vector<Landmark> landmarks = axis_landmarks(mesh, 0.5 * size);
  return {std::move(mesh), std::move(landmarks)};
}

}  // namespace touchfield
