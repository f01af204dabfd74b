#include "sim/mesh/query/inspect.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/pieces.h"
#include "sim/mesh/topology.h"

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

}  // namespace touchfield
