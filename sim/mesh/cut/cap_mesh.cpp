#include "sim/mesh/cut/cap_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <vtkCellArray.h>
#include <vtkContourTriangulator.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>

#include "sim/core/errors.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/mesh/subset.h"

namespace touchfield {

namespace {

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Caps in the plane of their chart.
class CapEditor {
 public:
  CapEditor(ClippedSurface& surface, Eigen::Index skin_faces, const CapChart& chart,
            const std::function<double(const Vector3&)>& edge)
      : surface_(surface),
        chart_(chart),
        edge_(edge),
        mesh_(as_columns(surface.triangles), static_cast<Eigen::Index>(surface.points.size())),
        first_side_(static_cast<int>(3 * skin_faces)),
        first_added_(mesh_.vertex_count()),
        places_(surface.points.size()),
        wanted_(surface.points.size(), 0.0) {
    measure_rims();
  }

  void refine() {
    constexpr int kRounds = 30;  // of halving the longest edges: more than any cap needs
    constexpr int kSmoothings = 6;
    make_delaunay();
    for (int i = 0; i < kRounds && split_long_edges(); ++i) {
      make_delaunay();
    }
    for (int i = 0; i < kSmoothings; ++i) {
      smooth();
      make_delaunay();
    }
    std::vector<int> numbers;
    surface_.triangles = as_triples(mesh_.compact(numbers));
  }

 private:
  const Vector3& point(int v) const { return surface_.points[static_cast<std::size_t>(v)]; }
  Eigen::Vector2d& place(int v) { return places_[static_cast<std::size_t>(v)]; }
  const Eigen::Vector2d& place(int v) const { return places_[static_cast<std::size_t>(v)]; }
  double& wanted(int v) { return wanted_[static_cast<std::size_t>(v)]; }
  bool is_cap(int side) const { return side >= first_side_; }
  bool is_inner(int side) const { return is_cap(side) && is_cap(mesh_.opposite(side)); }
  double length(int side) const { return (point(mesh_.from(side)) - point(mesh_.to(side))).norm(); }

  /// The wanted length at a point of a rim is the mean length of the rim's two edges there.
  void measure_rims() {
    for (int side = first_side_; side < mesh_.side_count(); ++side) {
      place(mesh_.from(side)) = chart_.to_plane(point(mesh_.from(side)));
      if (!is_inner(side)) {
        wanted(mesh_.from(side)) += 0.5 * length(side);
        wanted(mesh_.to(side)) += 0.5 * length(side);
      }
    }
  }

  bool split_long_edges() {
    constexpr double kLongest = 1.7;
    constexpr double kGrowth = 0.3;  // of the wanted length with the distance
    bool changed = false;
    for (int side = first_side_, last = mesh_.side_count(); side < last; ++side) {
      const double mean = 0.5 * (wanted(mesh_.from(side)) + wanted(mesh_.to(side)));
      if (is_inner(side) && length(side) > kLongest * mean) {
        const Eigen::Vector2d middle = 0.5 * (place(mesh_.from(side)) + place(mesh_.to(side)));
        const double grown = mean + 0.5 * kGrowth * length(side);
        mesh_.split(side);
        places_.push_back(middle);
        surface_.points.push_back(chart_.to_space(middle));
        wanted_.push_back(std::min(edge_(surface_.points.back()), grown));
        changed = true;
      }
    }
    return changed;
  }

  /// Moves every point that was added to the middle of its neighbours, if the faces round it keep their sense.
  void smooth() {
    for (int v = first_added_; v < mesh_.vertex_count(); ++v) {
      Vector3 sum = Vector3::Zero();
      for (const int side : mesh_.around(v)) {
        sum += point(mesh_.to(side));
      }
      const Eigen::Vector2d p = chart_.to_plane(sum / mesh_.valence(v));
      bool keeps = true;
      for (const int side : mesh_.around(v)) {
        keeps = keeps && turn(p, place(mesh_.to(side)), place(mesh_.apex(side))) > 0;
      }
      if (keeps) {
        place(v) = p;
        surface_.points[static_cast<std::size_t>(v)] = chart_.to_space(p);
      }
    }
  }

  void make_delaunay() {
    std::vector<int> open;
    for (int side = first_side_; side < mesh_.side_count(); ++side) {
      open.push_back(side);
    }
    // Each flip brings the edges nearer to Delaunay; what rounding makes go round in circles ends here.
    for (std::size_t i = 0, most = 20 * open.size(); i < open.size() && i < most; ++i) {
      const int side = open[i];
      if (is_inner(side) && is_illegal(side) && mesh_.can_flip(side)) {
        const int other = mesh_.opposite(side);
        mesh_.flip(side);
        open.insert(open.end(),
                    {EditMesh::next(side), EditMesh::previous(side), EditMesh::next(other), EditMesh::previous(other)});
      }
    }
  }

  /// Whether the angles opposite to an edge are together above pi, and its faces a convex quadrangle.
  bool is_illegal(int side) const {
    constexpr double kRounding = 1e-9;
    const Eigen::Vector2d& a = place(mesh_.from(side));
    const Eigen::Vector2d& b = place(mesh_.to(side));
    const Eigen::Vector2d& c = place(mesh_.apex(side));
    const Eigen::Vector2d& d = place(mesh_.apex(mesh_.opposite(side)));
    if (!(turn(a, d, c) > 0 && turn(d, b, c) > 0)) {
      return false;
    }
    const double at_c = std::atan2(turn(c, a, b), (a - c).dot(b - c));
    const double at_d = std::atan2(turn(d, b, a), (a - d).dot(b - d));
    return at_c + at_d > std::numbers::pi + kRounding;
  }

  ClippedSurface& surface_;
  const CapChart& chart_;
  const std::function<double(const Vector3&)>& edge_;
  EditMesh mesh_;
  int first_side_;                       // of the caps
  int first_added_;                      // point
  std::vector<Eigen::Vector2d> places_;  // of the caps' points
  std::vector<double> wanted_;           // edge length at each
};

}  // namespace

void add_caps(ClippedSurface& surface, const CapChart& chart) {
  vtkNew<vtkPoints> places;
  places->SetDataTypeToDouble();
  vtkNew<vtkCellArray> edges;
  std::vector<int> numbers;
  for (const std::vector<int>& loop : loops_of(surface)) {
    const auto first = static_cast<vtkIdType>(numbers.size());
    const auto count = static_cast<vtkIdType>(loop.size());
    for (vtkIdType i = 0; i < count; ++i) {
      const int v = loop[static_cast<std::size_t>(i)];
      const Eigen::Vector2d p = chart.to_plane(surface.points[static_cast<std::size_t>(v)]);
      places->InsertNextPoint(p.x(), p.y(), 0.0);
      numbers.push_back(v);
      const std::array<vtkIdType, 2> ends = {first + i, first + (i + 1) % count};
      edges->InsertNextCell(2, ends.data());
    }
  }
  vtkNew<vtkPolyData> rims;
  rims->SetPoints(places);
  rims->SetLines(edges);
  vtkNew<vtkCellArray> faces;
  constexpr std::array<double, 3> kUp = {0, 0, 1};
  if (vtkContourTriangulator::TriangulateContours(rims, 0, edges->GetNumberOfCells(), faces, kUp.data()) == 0) {
    throw InputError("mesh: the edges of a cut do not bound an inside: the surface intersects itself there");
  }
  vtkNew<vtkIdList> face;
  for (faces->InitTraversal(); faces->GetNextCell(face) != 0;) {
    std::array<int, 3> corners{};
    for (std::size_t c = 0; c < 3; ++c) {
      corners[c] = numbers[static_cast<std::size_t>(face->GetId(static_cast<vtkIdType>(c)))];
    }
    surface.triangles.push_back(corners);
  }
}

void refine_caps(ClippedSurface& surface, Eigen::Index skin_faces, const CapChart& chart,
                 const std::function<double(const Vector3&)>& edge) {
  CapEditor(surface, skin_faces, chart, edge).refine();
}

}  // namespace touchfield
