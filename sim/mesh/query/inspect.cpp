#include "sim/mesh/query/inspect.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/self_intersections.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// Counts one kind of fault and keeps the place of the first.
class FaultCount {
 public:
  void add_edge(const Points& points, const Side& side) {
    if (count_++ == 0) {
      const Vector3 middle = 0.5 * (points.col(side.low) + points.col(side.high));
      first_ = fmt::format("between vertices {} and {} near {}", side.low, side.high, place_text(middle, 2));
    }
  }

  void add_vertex(const Points& points, Index vertex) {
    if (count_++ == 0) {
      first_ = fmt::format("vertex {} at {}", vertex, place_text(points.col(vertex), 2));
    }
  }

  void add_face(const Points& points, const Triangles& triangles, Index face) {
    if (count_++ == 0) {
      const Vector3 centroid = points(Eigen::all, triangles.col(face)).rowwise().mean();
      first_ = fmt::format("with face {} at {}", face, place_text(centroid, 2));
    }
  }

  Index count() const { return count_; }

  void report(const char* one, const char* many, const std::string& meaning, std::vector<std::string>& faults) const {
    if (count_ > 0) {
      faults.push_back(fmt::format("{} ({}), the first {}", counted(count_, one, many), meaning, first_));
    }
  }

 private:
  Index count_ = 0;
  std::string first_;
};

struct Faults {
  FaultCount boundary_edges;
  FaultCount nonmanifold_edges;
  FaultCount misoriented_edges;
  FaultCount nonmanifold_vertices;
  FaultCount inside_out_pieces;
  FaultCount nested_pieces;
  FaultCount flat_pieces;
};

void walk_edges(const Points& points, const std::vector<Side>& sides, Faults& faults) {
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 1) {
      faults.boundary_edges.add_edge(points, edge[0]);
    } else if (edge.size() > 2) {
      faults.nonmanifold_edges.add_edge(points, edge[0]);
    } else if (edge[0].upwards == edge[1].upwards) {
      faults.misoriented_edges.add_edge(points, edge[0]);
    }
  });
}

std::vector<Hole> find_holes(const Points& points, const std::vector<Side>& sides) {
  DisjointSets rims(points.cols());
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 1) {
      rims.join(edge[0].low, edge[0].high);
    }
  });
  std::map<Index, Hole> holes;
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() == 1) {
      Hole& hole = holes.try_emplace(rims.root(edge[0].low), Hole{0, 0.0, Vector3::Zero()}).first->second;
      ++hole.edges;
      hole.length += (points.col(edge[0].high) - points.col(edge[0].low)).norm();
      hole.at += 0.5 * (points.col(edge[0].high) + points.col(edge[0].low));
    }
  });
  std::vector<Hole> list;
  for (auto& [root, hole] : holes) {
    hole.at /= static_cast<double>(hole.edges);
    list.push_back(hole);
  }
  std::stable_sort(list.begin(), list.end(), [](const Hole& h, const Hole& i) { return h.length > i.length; });
  return list;
}

std::string holes_text(const std::vector<Hole>& holes) {
  if (holes.empty()) {
    return {};
  }
  const double longest = holes.front().length / kMillimetre;
  return holes.size() == 1 ? fmt::format("1 hole of {:.2f} mm", longest)
                           : fmt::format("{} holes, the longest of {:.2f} mm", holes.size(), longest);
}

/// Returns the number of vertices without a face.
Index walk_vertices(const Points& points, const Triangles& triangles, const std::vector<Side>& sides, Faults& faults) {
  constexpr Index kNone = -1;
  DisjointSets corners = fans(triangles, sides);
  std::vector<Index> fan(static_cast<std::size_t>(points.cols()), kNone);
  std::vector<bool> split(fan.size(), false);
  for (Index f = 0; f < triangles.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const auto vertex = static_cast<std::size_t>(triangles(c, f));
      const Index root = corners.root(3 * f + c);
      if (fan[vertex] == kNone) {
        fan[vertex] = root;
      } else if (fan[vertex] != root) {
        split[vertex] = true;
      }
    }
  }
  for (std::size_t v = 0; v < split.size(); ++v) {
    if (split[v]) {
      faults.nonmanifold_vertices.add_vertex(points, static_cast<Index>(v));
    }
  }
  return std::count(fan.begin(), fan.end(), kNone);
}

void walk_pieces(const Points& points, const Triangles& triangles, const Pieces& pieces, Faults& faults) {
  const std::vector<bool> inner = nested(points, triangles, pieces);
  for (std::size_t p = 0; p < pieces.list.size(); ++p) {
    const Piece& piece = pieces.list[p];
    if (piece.flat()) {
      faults.flat_pieces.add_face(points, triangles, piece.face);
    } else if (piece.volume < 0) {
      faults.inside_out_pieces.add_face(points, triangles, piece.face);
    }
    if (inner[p]) {
      faults.nested_pieces.add_face(points, triangles, piece.face);
    }
  }
}

void measure_shape(const Points& points, const Triangles& triangles, MeshReport& report) {
  report.shortest_edge = std::numeric_limits<double>::infinity();
  report.smallest_angle = std::numeric_limits<double>::infinity();
  for (const auto& face : triangles.colwise()) {
    report.area += 0.5 * twice_area_vector(points, face).norm();
    for (int c = 0; c < 3; ++c) {
      const double edge = (points.col(face((c + 1) % 3)) - points.col(face(c))).norm();
      report.shortest_edge = std::min(report.shortest_edge, edge);
      report.longest_edge = std::max(report.longest_edge, edge);
    }
    report.smallest_angle =
        std::min(report.smallest_angle, smallest_angle(points.col(face(0)), points.col(face(1)), points.col(face(2))));
  }
}

/// The faces that have an area, those of pieces of negative volume turned round, so that every piece looks outwards.
///
/// piece_of   set to the piece of each face of the result
TriangleMesh outward_mesh(const Points& points, const Triangles& triangles, const Pieces& pieces,
                          std::vector<std::size_t>& piece_of) {
  Triangles outward(3, triangles.cols());
  Index count = 0;
  for (Index f = 0; f < triangles.cols(); ++f) {
    if (is_flat(points, triangles.col(f))) {
      continue;
    }
    outward.col(count) = triangles.col(f);
    const int piece = pieces.of_face[static_cast<std::size_t>(f)];
    if (pieces.list[static_cast<std::size_t>(piece)].volume < 0) {
      std::swap(outward(1, count), outward(2, count));
    }
    piece_of.push_back(static_cast<std::size_t>(piece));
    ++count;
  }
  outward.conservativeResize(3, count);
  return {points, std::move(outward)};
}

std::vector<Box> boxes_round(const Points& points, const Triangles& triangles, const Pieces& pieces) {
  std::vector<Box> boxes(pieces.list.size());
  for (Index f = 0; f < triangles.cols(); ++f) {
    for (const int v : triangles.col(f)) {
      boxes[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])].extend(Vector3(points.col(v)));
    }
  }
  return boxes;
}

TriangleMesh part(const TriangleMesh& mesh, const std::vector<Index>& faces) {
  return {mesh.vertices(), mesh.triangles()(Eigen::all, faces)};
}

/// Those of the pieces `within` another one's box that lie inside it.
///
/// mesh   every piece looks outwards
std::vector<std::size_t> inside(const TriangleMesh& mesh, const std::vector<std::vector<Index>>& faces_of,
                                const std::vector<std::size_t>& piece_of, std::size_t outer,
                                std::vector<std::size_t> within) {
  const TriangleMesh shell = part(mesh, faces_of[outer]);
  const FaceTree tree(shell);
  std::erase_if(within, [&](std::size_t inner) {
    return !std::ranges::all_of(faces_of[inner], [&](Index f) {
      constexpr double kLift = 1e-3;  // of the face's size: just outside the inner piece
      constexpr double kOnce = 0.5;   // between not at all and once
      const Vector3 lift = kLift * std::sqrt(mesh.areas()(f)) * mesh.normals().col(f);
      return tree.winding_number(mesh.centroids().col(f) + lift) > kOnce;
    });
  });
  // A face may reach out of the shell though its centroid is inside.
  std::vector<Index> faces;
  for (const std::size_t inner : within) {
    faces.insert(faces.end(), faces_of[inner].begin(), faces_of[inner].end());
  }
  if (faces.empty()) {
    return within;
  }
  std::set<std::size_t> cutting;
  for (const auto& [f, g] : intersections(part(mesh, faces), shell, std::numeric_limits<std::size_t>::max())) {
    cutting.insert(piece_of[static_cast<std::size_t>(faces[static_cast<std::size_t>(f)])]);
  }
  std::erase_if(within, [&](std::size_t inner) { return cutting.contains(inner); });
  return within;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void measure_sizes(const TriangleMesh& mesh, const Eigen::VectorXd& sizes, MeshRisks& risks) {
  const EdgeTable edges = edge_table(mesh.triangles());
  const Index count = edges.ends.cols();
  Eigen::VectorXd smallest = Eigen::VectorXd::Constant(count, kInfinity);
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(count);
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (const int e : edges.of_face.col(f)) {
      smallest(e) = std::min(smallest(e), sizes(f));
      largest(e) = std::max(largest(e), sizes(f));
    }
  }
  Index worst = 0;
  risks.size_jump = (largest.array() / smallest.array()).maxCoeff(&worst);
  const auto end = [&](int which, Index e) { return mesh.vertices().col(edges.ends(which, e)); };
  risks.jump_at = 0.5 * (end(0, worst) + end(1, worst));

  double shortest = kInfinity;
  double longest = 0;
  for (Index e = 0; e < count; ++e) {
    const double length = (end(1, e) - end(0, e)).norm();
    shortest = std::min(shortest, length);
    longest = std::max(longest, length);
  }
  risks.size_range = longest / shortest;
}

void measure_angles(const TriangleMesh& mesh, MeshRisks& risks) {
  risks.smallest_angle = kInfinity;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const double angle = corner_angle(mesh, f, c);
      if (angle < risks.smallest_angle) {
        risks.smallest_angle = angle;
        risks.angle_at = mesh.corner(f, c);
      }
    }
  }
}

/// The nearest face that looks at a face, by distance over the face's local edge.
struct Opposite {
  double ratio = kInfinity;
  Index face = -1;

  void consider(double other_ratio, Index other) {
    if (other_ratio < ratio || (other_ratio == ratio && other < face)) {
      ratio = other_ratio;
      face = other;
    }
  }
};

Vector3 midway(const TriangleMesh& mesh, const Eigen::VectorXd& sizes, const std::vector<Opposite>& opposites,
               double& least, double& edge) {
  const auto worst = std::min_element(opposites.begin(), opposites.end(),
                                      [](const Opposite& o, const Opposite& p) { return o.ratio < p.ratio; });
  least = worst->ratio;
  edge = sizes(worst - opposites.begin());
  if (worst->face < 0) {
    return Vector3::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return 0.5 * (mesh.centroids().col(worst - opposites.begin()) + mesh.centroids().col(worst->face));
}

void measure_distances(const TriangleMesh& mesh, const Eigen::VectorXd& sizes, MeshRisks& risks) {
  constexpr double kReach = 5.0;  // local edges
  const FaceTree tree(mesh);
  const auto faces = static_cast<std::size_t>(mesh.face_count());
  std::vector<Opposite> through_air(faces);
  std::vector<Opposite> through_body(faces);
#pragma omp parallel
  {
    std::vector<Index> found;
#pragma omp for schedule(dynamic, 64)
    for (Index i = 0; i < mesh.face_count(); ++i) {
      tree.centroids_within(mesh.centroids().col(i), kReach * sizes(i), found);
      for (const Index j : found) {
        // A pair counts once, from its larger face.
        const Facing how = sizes(j) > sizes(i) ? Facing::kNot : facing(mesh, i, j);
        if (how == Facing::kNot) {
          continue;
        }
        const double distance = (mesh.centroids().col(j) - mesh.centroids().col(i)).norm();
        auto& opposites = how == Facing::kThroughAir ? through_air : through_body;
        opposites[static_cast<std::size_t>(i)].consider(distance / sizes(i), j);
      }
    }
  }
  risks.gap_at = midway(mesh, sizes, through_air, risks.gap, risks.gap_edge);
  risks.thickness_at = midway(mesh, sizes, through_body, risks.thickness, risks.thickness_edge);
}

}  // namespace

MeshReport inspect(const TriangleMesh& mesh) { return inspect(mesh.vertices(), mesh.triangles()); }

MeshReport inspect(const Points& points, const Triangles& triangles) {
  MeshReport report;
  report.faces = triangles.cols();
  report.vertices = points.cols();
  measure_shape(points, triangles, report);

  const std::vector<Side> sides = sorted_sides(triangles);
  Faults faults;
  walk_edges(points, sides, faults);
  report.boundary_edges = faults.boundary_edges.count();
  report.nonmanifold_edges = faults.nonmanifold_edges.count();
  report.misoriented_edges = faults.misoriented_edges.count();
  report.holes = find_holes(points, sides);
  report.unused_vertices = walk_vertices(points, triangles, sides, faults);
  report.nonmanifold_vertices = faults.nonmanifold_vertices.count();
  const Pieces pieces = find_pieces(points, triangles, sides);
  report.components = static_cast<Index>(pieces.list.size());
  for (const Piece& piece : pieces.list) {
    report.volume += piece.volume;
  }
  if (report.closed() && report.misoriented_edges == 0) {
    walk_pieces(points, triangles, pieces, faults);
  }
  report.inside_out = faults.inside_out_pieces.count() > 0;
  report.nested_pieces = faults.nested_pieces.count();

  faults.boundary_edges.report("boundary edge", "boundary edges", holes_text(report.holes), report.faults);
  faults.nonmanifold_edges.report("non-manifold edge", "non-manifold edges", "three faces or more", report.faults);
  faults.misoriented_edges.report("misoriented edge", "misoriented edges", "its two faces run the same way round",
                                  report.faults);
  faults.nonmanifold_vertices.report("non-manifold vertex", "non-manifold vertices", "parts touch in one point",
                                     report.faults);
  faults.inside_out_pieces.report("piece inside out", "pieces inside out", "the normals point inwards", report.faults);
  faults.nested_pieces.report("piece inside another", "pieces inside others", "no sound reaches it", report.faults);
  faults.flat_pieces.report("piece without volume", "pieces without volume", "faces lie back to back", report.faults);
  return report;
}

void require_closed_surface(const TriangleMesh& mesh, const std::string& name) {
  const MeshReport report = inspect(mesh);
  if (!report.faults.empty()) {
    throw InputError(fmt::format("{}: the mesh must be a closed surface with outward normals: {}", name,
                                 fmt::join(report.faults, "; ")));
  }
}

bool Piece::flat() const {
  constexpr double kFlat = 1e-9;  // volume over area^1.5, 0.094 for a sphere: rounding leaves 1e-16 times the distance
  return std::abs(volume) <= kFlat * std::pow(area, 1.5);
}

Pieces find_pieces(const Points& points, const Triangles& triangles, const std::vector<Side>& sides, std::size_t most) {
  DisjointSets faces(triangles.cols());
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& other : edge.subspan(edge.size() > most ? edge.size() : 1)) {
      faces.join(edge[0].face, other.face);
    }
  });
  int count = 0;
  Pieces pieces{faces.numbered(count), {}};
  pieces.list.resize(static_cast<std::size_t>(count), {-1, 0, 0.0, 0.0});
  for (Index f = 0; f < triangles.cols(); ++f) {
    Piece& piece = pieces.list[static_cast<std::size_t>(pieces.of_face[static_cast<std::size_t>(f)])];
    piece.face = piece.faces++ == 0 ? f : piece.face;
    const Vector3 twice_area = twice_area_vector(points, triangles.col(f));
    piece.area += 0.5 * twice_area.norm();
    // About a point of its own: a piece far from the origin loses no digits.
    const Vector3 from_first = points.col(triangles(0, f)) - points.col(triangles(0, piece.face));
    piece.volume += from_first.dot(twice_area) / 6.0;
  }
  return pieces;
}

std::vector<bool> nested(const Points& points, const Triangles& triangles, const Pieces& pieces) {
  std::vector<bool> is_nested(pieces.list.size(), false);
  if (pieces.list.size() < 2) {
    return is_nested;
  }
  std::vector<std::size_t> piece_of;
  const TriangleMesh mesh = outward_mesh(points, triangles, pieces, piece_of);
  std::vector<std::vector<Index>> faces_of(pieces.list.size());
  for (Index f = 0; f < mesh.face_count(); ++f) {
    faces_of[piece_of[static_cast<std::size_t>(f)]].push_back(f);
  }
  const std::vector<Box> boxes = boxes_round(points, triangles, pieces);
  const BoxTree near(boxes);
  for (std::size_t outer = 0; outer < faces_of.size(); ++outer) {
    std::vector<std::size_t> within;
    near.for_each_meeting(boxes[outer], [&](Index piece) {
      const auto inner = static_cast<std::size_t>(piece);
      if (inner != outer && !is_nested[inner] && !faces_of[inner].empty() && boxes[outer].contains(boxes[inner])) {
        within.push_back(inner);
      }
    });
    if (!within.empty() && !faces_of[outer].empty()) {
      for (const std::size_t inner : inside(mesh, faces_of, piece_of, outer, within)) {
        is_nested[inner] = true;
      }
    }
  }
  return is_nested;
}

Facing facing(const TriangleMesh& mesh, Index i, Index j) {
  constexpr double kAgainst = -0.5;  // of the normals: 60 degrees short of opposite
  constexpr double kAlong = 0.5;     // of a normal and the line: 60 degrees
  if (mesh.normals().col(j).dot(mesh.normals().col(i)) >= kAgainst) {
    return Facing::kNot;
  }
  const Vector3 line = mesh.centroids().col(j) - mesh.centroids().col(i);
  const double distance = line.norm();
  const double leaves = line.dot(mesh.normals().col(i));
  const double arrives = -line.dot(mesh.normals().col(j));
  if (std::min(leaves, arrives) > kAlong * distance) {
    return Facing::kThroughAir;
  }
  return std::max(leaves, arrives) < -kAlong * distance ? Facing::kThroughBody : Facing::kNot;
}

MeshRisks mesh_risks(const TriangleMesh& mesh) {
  const Eigen::VectorXd local_edges = (mesh.areas().array() * (4.0 / std::sqrt(3.0))).sqrt();
  MeshRisks risks;
  measure_sizes(mesh, local_edges, risks);
  measure_angles(mesh, risks);
  measure_distances(mesh, local_edges, risks);
  return risks;
}

}  // namespace touchfield
