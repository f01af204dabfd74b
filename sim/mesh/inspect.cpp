#include "sim/mesh/inspect.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// Side c of face f, from corner c to corner c + 1; low < high are its vertices. Sides of one edge sort together.
struct Side {
  int low;
  int high;
  Index face;
  int corner;
  bool upwards;  // runs from low to high

  bool same_edge(const Side& other) const { return low == other.low && high == other.high; }
};

/// Disjoint sets of 0..n-1.
class DisjointSets {
 public:
  explicit DisjointSets(Index n) : parent_(static_cast<std::size_t>(n)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  Index root(Index i) {
    while (parent_[static_cast<std::size_t>(i)] != i) {
      auto& parent = parent_[static_cast<std::size_t>(i)];
      parent = parent_[static_cast<std::size_t>(parent)];
      i = parent;
    }
    return i;
  }

  void join(Index a, Index b) { parent_[static_cast<std::size_t>(root(b))] = root(a); }

 private:
  std::vector<Index> parent_;
};

std::vector<Side> sorted_sides(const Triangles& triangles) {
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(3 * triangles.cols()));
  for (Index f = 0; f < triangles.cols(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = triangles(c, f);
      const int b = triangles((c + 1) % 3, f);
      sides.push_back({std::min(a, b), std::max(a, b), f, c, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
    return std::tie(s.low, s.high, s.face, s.corner) < std::tie(t.low, t.high, t.face, t.corner);
  });
  return sides;
}

std::string place(const Vector3& point) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) mm", point.x() * 1e3, point.y() * 1e3, point.z() * 1e3);
}

/// Counts one kind of fault and keeps the place of the first.
class FaultCount {
 public:
  void add_edge(const TriangleMesh& mesh, const Side& side) {
    if (count_++ == 0) {
      const Vector3 middle = 0.5 * (mesh.vertices().col(side.low) + mesh.vertices().col(side.high));
      first_ = fmt::format("between vertices {} and {} near {}", side.low, side.high, place(middle));
    }
  }

  void add_vertex(const TriangleMesh& mesh, Index vertex) {
    if (count_++ == 0) {
      first_ = fmt::format("vertex {} at {}", vertex, place(mesh.vertices().col(vertex)));
    }
  }

  void add_face(const TriangleMesh& mesh, Index face) {
    if (count_++ == 0) {
      first_ = fmt::format("with face {} at {}", face, place(mesh.centroids().col(face)));
    }
  }

  Index count() const { return count_; }

  void report(const char* one, const char* many, const char* meaning, std::vector<std::string>& faults) const {
    if (count_ > 0) {
      faults.push_back(fmt::format("{} {} ({}), the first {}", count_, count_ == 1 ? one : many, meaning, first_));
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
  FaultCount flat_pieces;
};

/// Corner of `face` at `vertex`, numbered 3 face + corner.
Index corner_at(const Triangles& triangles, Index face, int vertex) {
  int c = 0;
  while (triangles(c, face) != vertex) {
    ++c;
  }
  return 3 * face + c;
}

/// Goes through the edges; joins the faces that meet at an edge, and their corners at its two ends.
void walk_edges(const TriangleMesh& mesh, DisjointSets& faces, DisjointSets& corners, Faults& faults) {
  const std::vector<Side> sides = sorted_sides(mesh.triangles());
  for (std::size_t first = 0; first < sides.size();) {
    std::size_t last = first + 1;
    for (; last < sides.size() && sides[last].same_edge(sides[first]); ++last) {
      faces.join(sides[first].face, sides[last].face);
      for (const int vertex : {sides[first].low, sides[first].high}) {
        corners.join(corner_at(mesh.triangles(), sides[first].face, vertex),
                     corner_at(mesh.triangles(), sides[last].face, vertex));
      }
    }
    const std::size_t count = last - first;
    if (count == 1) {
      faults.boundary_edges.add_edge(mesh, sides[first]);
    } else if (count > 2) {
      faults.nonmanifold_edges.add_edge(mesh, sides[first]);
    } else if (sides[first].upwards == sides[first + 1].upwards) {
      faults.misoriented_edges.add_edge(mesh, sides[first]);
    }
    first = last;
  }
}

/// A vertex is a manifold point if its corners form one set. Returns the number of vertices without a face.
Index walk_vertices(const TriangleMesh& mesh, DisjointSets& corners, Faults& faults) {
  constexpr Index kNone = -1;
  std::vector<Index> fan(static_cast<std::size_t>(mesh.vertex_count()), kNone);
  std::vector<bool> split(fan.size(), false);
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const auto vertex = static_cast<std::size_t>(mesh.triangles()(c, f));
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
      faults.nonmanifold_vertices.add_vertex(mesh, static_cast<Index>(v));
    }
  }
  return std::count(fan.begin(), fan.end(), kNone);
}

/// Number of pieces. `oriented`: the surface is closed and consistent, so that the volume of a piece means something.
Index walk_pieces(const TriangleMesh& mesh, DisjointSets& faces, bool oriented, Faults& faults) {
  struct Piece {
    Index face;
    double volume;
    double area;
  };
  const Vector3 origin = mesh.vertices().rowwise().mean();
  std::vector<Index> piece_of(static_cast<std::size_t>(mesh.face_count()), -1);
  std::vector<Piece> pieces;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    Index& number = piece_of[static_cast<std::size_t>(faces.root(f))];
    if (number < 0) {
      number = static_cast<Index>(pieces.size());
      pieces.push_back({f, 0.0, 0.0});
    }
    Piece& piece = pieces[static_cast<std::size_t>(number)];
    piece.volume += (mesh.centroids().col(f) - origin).dot(mesh.normals().col(f)) * mesh.areas()(f) / 3.0;
    piece.area += mesh.areas()(f);
  }
  constexpr double kFlat = 1e-9;  // volume over area^1.5, 0.094 for a sphere: rounding leaves 1e-16 times the distance
  for (const Piece& piece : pieces) {
    if (!oriented) {
      break;
    }
    if (std::abs(piece.volume) <= kFlat * std::pow(piece.area, 1.5)) {
      faults.flat_pieces.add_face(mesh, piece.face);
    } else if (piece.volume < 0) {
      faults.inside_out_pieces.add_face(mesh, piece.face);
    }
  }
  return static_cast<Index>(pieces.size());
}

void measure_shape(const TriangleMesh& mesh, MeshReport& report) {
  report.shortest_edge = std::numeric_limits<double>::infinity();
  report.smallest_angle = std::numeric_limits<double>::infinity();
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const Vector3 along = mesh.corner(f, (c + 1) % 3) - mesh.corner(f, c);
      const Vector3 back = mesh.corner(f, (c + 2) % 3) - mesh.corner(f, c);
      report.shortest_edge = std::min(report.shortest_edge, along.norm());
      report.longest_edge = std::max(report.longest_edge, along.norm());
      // The arc tangent keeps its digits at small angles, where the arc cosine loses them.
      report.smallest_angle = std::min(report.smallest_angle, std::atan2(along.cross(back).norm(), along.dot(back)));
    }
  }
}

}  // namespace

MeshReport inspect(const TriangleMesh& mesh) {
  MeshReport report;
  report.faces = mesh.face_count();
  report.vertices = mesh.vertex_count();
  report.area = mesh.total_area();
  report.volume = mesh.signed_volume();
  measure_shape(mesh, report);

  DisjointSets faces(mesh.face_count());
  DisjointSets corners(3 * mesh.face_count());
  Faults faults;
  walk_edges(mesh, faces, corners, faults);
  report.boundary_edges = faults.boundary_edges.count();
  report.nonmanifold_edges = faults.nonmanifold_edges.count();
  report.misoriented_edges = faults.misoriented_edges.count();
  report.unused_vertices = walk_vertices(mesh, corners, faults);
  report.nonmanifold_vertices = faults.nonmanifold_vertices.count();
  report.components = walk_pieces(mesh, faces, report.closed() && report.misoriented_edges == 0, faults);
  report.inside_out = faults.inside_out_pieces.count() > 0;

  faults.boundary_edges.report("boundary edge", "boundary edges", "holes", report.faults);
  faults.nonmanifold_edges.report("non-manifold edge", "non-manifold edges", "three faces or more", report.faults);
  faults.misoriented_edges.report("misoriented edge", "misoriented edges", "its two faces run the same way round",
                                  report.faults);
  faults.nonmanifold_vertices.report("non-manifold vertex", "non-manifold vertices", "parts touch in one point",
                                     report.faults);
  faults.inside_out_pieces.report("piece inside out", "pieces inside out", "the normals point inwards", report.faults);
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

}  // namespace touchfield
