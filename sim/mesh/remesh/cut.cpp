#include "sim/mesh/remesh/cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkContourTriangulator.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/creases.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/remesh/remesh.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

struct Cube {
  Vector3 centre;
  double reach;

  bool holds(const Vector3& x, double share = 1.0) const { return cube_distance(x, centre) < share * reach; }
};

/// A closed surface while sides of the cube cut it; faces may have no area.
struct Surface {
  std::vector<Vector3> points;
  std::vector<std::array<int, 3>> triangles;
};

using Loop = std::vector<int>;

/// A side of the cube, as the plane that the cap in it is made in: anticlockwise from outside.
struct CubeSide {
  Vector3 outward;
  double reach;  // outward . x on it

  double height(const Vector3& x) const { return outward.dot(x) - reach; }
  Eigen::Vector2d flat(const Vector3& x) const {
    const Vector3 u = Vector3(outward.z(), outward.x(), outward.y());
    return {u.dot(x), outward.cross(u).dot(x)};
  }
};

/// Takes off what is beyond a side. Vertices that all but lie in it are moved beyond it before, so that no edge is cut
/// next to its end.
///
/// returns   the rims, as a filling runs along them
std::vector<Loop> cut_off(Surface& surface, const CubeSide& side, const EdgeSizing& sizing) {
  constexpr double kLeast = 0.02;  // of the wanted edge
  std::vector<double> heights;
  for (Vector3& x : surface.points) {
    const double height = side.height(x);
    const double least = kLeast * sizing.at(x);
    heights.push_back(std::abs(height) < least ? least : height);
    x += (heights.back() - height) * side.outward;
  }
  const auto height = [&](int v) { return heights[static_cast<std::size_t>(v)]; };
  std::map<std::pair<int, int>, int> on_edges;
  const auto on_edge = [&](int a, int b) {
    const auto [found, is_new] = on_edges.try_emplace(std::minmax(a, b), static_cast<int>(surface.points.size()));
    if (is_new) {
      const auto& [low, high] = found->first;
      const double share = height(low) / (height(low) - height(high));
      const Vector3 from = surface.points[static_cast<std::size_t>(low)];
      surface.points.emplace_back(from + share * (surface.points[static_cast<std::size_t>(high)] - from));
    }
    return found->second;
  };
  std::vector<std::array<int, 3>> kept;
  std::map<int, int> next;  // along the rims
  for (const std::array<int, 3>& face : surface.triangles) {
    std::vector<int> part;
    std::array<int, 2> rim{};
    for (std::size_t c = 0; c < 3; ++c) {
      const int v = face[c];
      const int w = face[(c + 1) % 3];
      if (height(v) < 0) {
        part.push_back(v);
      }
      if ((height(v) < 0) != (height(w) < 0)) {
        part.push_back(on_edge(v, w));
        rim[height(v) < 0 ? 1 : 0] = part.back();
      }
    }
    for (std::size_t i = 2; i < part.size(); ++i) {
      kept.push_back({part[0], part[i - 1], part[i]});
    }
    if (rim != std::array{0, 0}) {
      next[rim[0]] = rim[1];
    }
  }
  surface.triangles = std::move(kept);
  std::vector<Loop> loops;
  while (!next.empty()) {
    Loop& loop = loops.emplace_back();
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      loop.push_back(at->second);
      next.erase(at);
    }
  }
  return loops;
}

/// Closes rims in one plane. A cap may have any number of them.
void add_cap(Surface& surface, const std::vector<Loop>& loops, const CubeSide& side) {
  constexpr double kStraight = 1e-6;  // the triangulator is not up to points in one line: they are put in afterwards
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  vtkNew<vtkCellArray> edges;
  std::vector<int> numbers;
  std::map<std::pair<int, int>, Loop> between;
  const auto flat = [&](int v) { return side.flat(surface.points[static_cast<std::size_t>(v)]); };
  for (const Loop& loop : loops) {
    const auto first = static_cast<vtkIdType>(numbers.size());
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d at = flat(loop[i]);
      const Eigen::Vector2d from = at - flat(i == 0 ? loop.back() : loop[i - 1]);
      const Eigen::Vector2d to = flat(loop[(i + 1) % loop.size()]) - at;
      if (std::abs(from.x() * to.y() - from.y() * to.x()) > kStraight * from.norm() * to.norm() || from.dot(to) < 0) {
        numbers.push_back(loop[i]);
        places->InsertNextPoint(at.x(), at.y(), 0.0);
      }
    }
    const auto count = static_cast<vtkIdType>(numbers.size()) - first;
    require(count >= 3, "a rim is a line");
    for (vtkIdType i = 0; i < count; ++i) {
      const std::array<vtkIdType, 2> ends = {first + i, first + (i + 1) % count};
      edges->InsertNextCell(2, ends.data());
      const int from = numbers[static_cast<std::size_t>(ends[0])];
      const int to = numbers[static_cast<std::size_t>(ends[1])];
      auto at = std::ranges::find(loop, from);
      for (at = at + 1 == loop.end() ? loop.begin() : at + 1; *at != to;
           at = at + 1 == loop.end() ? loop.begin() : at + 1) {
        between[{from, to}].push_back(*at);
      }
    }
  }
  vtkNew<vtkPolyData> rims;
  rims->SetPoints(places);
  rims->SetLines(edges);
  vtkNew<vtkCellArray> faces;
  constexpr std::array<double, 3> kUp = {0, 0, 1};
  require(vtkContourTriangulator::TriangulateContours(rims, 0, edges->GetNumberOfCells(), faces, kUp.data()) != 0,
          "the rims do not bound an inside");
  std::vector<std::array<int, 3>> open;
  vtkIdType count = 0;
  const vtkIdType* corners = nullptr;
  for (faces->InitTraversal(); faces->GetNextCell(count, corners) != 0;) {
    open.push_back({numbers[static_cast<std::size_t>(corners[0])], numbers[static_cast<std::size_t>(corners[1])],
                    numbers[static_cast<std::size_t>(corners[2])]});
  }
  while (!open.empty()) {
    const std::array<int, 3> face = open.back();
    open.pop_back();
    bool whole = true;
    for (std::size_t c = 0; c < 3 && whole; ++c) {
      if (auto found = between.extract({face[c], face[(c + 1) % 3]})) {
        whole = false;
        int last = face[c];
        found.mapped().push_back(face[(c + 1) % 3]);
        for (const int v : found.mapped()) {
          open.push_back({last, v, face[(c + 2) % 3]});
          last = v;
        }
      }
    }
    if (whole) {
      surface.triangles.push_back(face);
    }
  }
}

/// The part of a body in a cube, closed by flat caps, of faces of any shape.
TriangleMesh clipped(const TriangleMesh& mesh, const Cube& cube, const EdgeSizing& sizing) {
  Surface surface{as_list(mesh.vertices()), {}};
  for (const auto& face : mesh.triangles().colwise()) {
    surface.triangles.push_back({face(0), face(1), face(2)});
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Vector3 outward = sign * Vector3::Unit(axis);
      const CubeSide side{outward, outward.dot(cube.centre) + cube.reach};
      if (const std::vector<Loop> rims = cut_off(surface, side, sizing); !rims.empty()) {
        add_cap(surface, rims, side);
      }
    }
  }
  constexpr double kFlat = 1e-3;  // area over longest edge squared
  const auto points = as_columns(surface.points);
  EditMesh edit(as_columns(surface.triangles), points.cols());
  remove_flat_faces(edit, points, kFlat);
  std::vector<int> numbers;
  Triangles kept = edit.compact(numbers);
  return {Points(points(Eigen::all, numbers)), std::move(kept)};
}

TriangleMesh nearest_piece(const TriangleMesh& mesh, const Vector3& point) {
  const Pieces pieces = find_pieces(mesh.vertices(), mesh.triangles(), sorted_sides(mesh.triangles()));
  const int kept = pieces.of_face[static_cast<std::size_t>(FaceTree(mesh).nearest(point).face)];
  Points points = mesh.vertices();
  Triangles triangles = faces_where(
      mesh.triangles(), [&](Eigen::Index f) { return pieces.of_face[static_cast<std::size_t>(f)] == kept; });
  drop_unused_points(points, triangles);
  return {std::move(points), std::move(triangles)};
}

/// The creases of a mesh, those vertices held that are to stay: paths end there, and edges between two stay as well.
std::vector<Crease> creases_about(const TriangleMesh& mesh, const std::vector<char>& stays,
                                  const std::function<Eigen::VectorXd(const Points&)>& edge_length) {
  const auto is_held = [&](int v) { return stays[static_cast<std::size_t>(v)] != 0; };
  std::vector<Crease> creases;
  for (const Crease& crease : find_creases(mesh, kCreaseAngle, edge_length)) {
    std::vector<int> path = {crease.vertices.front()};
    for (std::size_t i = 1; i < crease.vertices.size(); ++i) {
      path.push_back(crease.vertices[i]);
      if (is_held(path.back()) || i + 1 == crease.vertices.size()) {
        if (path.size() > 2 || !is_held(path.front()) || !is_held(path.back())) {
          creases.push_back({path});
        }
        path = {crease.vertices[i]};
      }
    }
  }
  const EdgeTable edges = edge_table(mesh.triangles());
  for (const auto& ends : edges.ends.colwise()) {
    if (is_held(ends(0)) && is_held(ends(1))) {
      creases.push_back({{ends(0), ends(1)}});
    }
  }
  return creases;
}

/// Meshes caps and the skin next to them again.
TriangleMesh remeshed_ends(const TriangleMesh& part, const Cube& cube, const EdgeSizing& sizing) {
  constexpr int kRounds = 10;
  constexpr double kThinnest = 0.03;  // of the wanted edge
  constexpr double kFacing = 0.5;     // least cosine between a point's normal and that of the face it is put on
  constexpr double kOwn = 1.3;        // of the wanted edge: own faces' edges differ, and need not be halved
  const auto wanted = [&](const Points& points) { return sizing.at(points); };
  const TriangleMesh start =
      without_splinters(part, [&](const Points& points) { return Eigen::VectorXd(kThinnest * sizing.at(points)); });
  std::vector<char> stays;
  std::vector<int> tips;
  for (const int tip : find_tips(start, wanted)) {
    tips.push_back(tip);
  }
  for (Eigen::Index v = 0; v < start.vertex_count(); ++v) {
    stays.push_back(cube.holds(start.vertices().col(v), kUncut) ? 1 : 0);
    if (stays.back() != 0) {
      tips.push_back(static_cast<int>(v));
    }
  }
  const FaceTree tree(part);
  const CreasedTarget target{[&](const Points& points) {
                               Eigen::VectorXd lengths = sizing.at(points);
                               for (Eigen::Index i = 0; i < lengths.size(); ++i) {
                                 lengths(i) *= cube.holds(points.col(i), kUncut) ? kOwn : 1.0;
                               }
                               return lengths;
                             },
                             [&](Points& moved, const Points& before, const Points& normals) {
                               for (Eigen::Index i = 0; i < moved.cols(); ++i) {
                                 const Vector3 x = moved.col(i);
                                 const SkinPoint skin = tree.nearest_facing(x, normals.col(i), kFacing);
                                 const bool near = skin.face >= 0 && skin.distance <= sizing.at(x);
                                 moved.col(i) = near ? skin.at : Vector3(before.col(i));
                               }
                             },
                             creases_about(start, stays, wanted), std::move(tips)};
  return remeshed(start.vertices(), start.triangles(), target, kRounds).mesh;
}

/// The body may intersect itself elsewhere: that is not the cut's doing.
void require_sound(const TriangleMesh& mesh, const Cube& cube) {
  constexpr double kThinnest = 1.0 / 180 * std::numbers::pi;
  const auto is_own = [&](Eigen::Index f) {
    return cube.holds(mesh.corner(f, 0), kUncut) && cube.holds(mesh.corner(f, 1), kUncut) &&
           cube.holds(mesh.corner(f, 2), kUncut);
  };
  require_closed_surface(mesh, "the part");
  const Eigen::VectorXd angles = smallest_angles(mesh);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (!is_own(f) && angles(f) < kThinnest) {
      throw InputError("a face is thinner than 1 degree near " + place_text(mesh.centroids().col(f), 2));
    }
  }
  for (const auto& [one, other] : self_intersections(mesh)) {
    if (!is_own(one) || !is_own(other)) {
      throw InputError("faces intersect near " + place_text(mesh.centroids().col(one), 2));
    }
  }
}

}  // namespace

TriangleMesh kept_within(const TriangleMesh& mesh, const Vector3& point, double reach, const EdgeSizing& sizing) {
  require(reach > 0 && std::isfinite(reach) && point.allFinite(),
          "keep_within_mm = {} must be > 0 and finite, around a finite point", reach * 1e3);
  const double distance = FaceTree(mesh).nearest(point).distance;
  require(distance <= 0.5 * reach,
          "keep_within_mm = {:.1f}: the nearest skin to {} is {:.1f} mm away, it must be within half of that",
          reach * 1e3, place_text(point, 2), distance * 1e3);
  if (((mesh.vertices().colwise() - point).cwiseAbs().array() < reach).all()) {
    return mesh;
  }
  std::string fault;
  for (const double share : {1.0, 1.02, 0.98, 1.04, 0.96, 1.06, 0.94}) {
    const Cube cube{point, share * reach};
    try {
      TriangleMesh part = remeshed_ends(nearest_piece(clipped(mesh, cube, sizing), point), cube, sizing);
      require_sound(part, cube);
      return part;
    } catch (const Error& error) {
      fault = fault.empty() ? error.what() : fault;
    }
  }
  throw InputError(
      fmt::format("keep_within_mm = {:.1f} around {}: the flat caps there leave no sound surface ({}). Change it by a "
                  "tenth or more, or leave it out",
                  reach * 1e3, place_text(point, 2), fault));
}

}  // namespace touchfield
