#include <algorithm>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolygon.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostCorners = 5000;  // the time grows as their square

/// Whether the corners enclose no area: all on one line or in one point.
bool has_no_area(const FileSurface& surface, const std::vector<std::int64_t>& corners) {
  constexpr double kNoArea = 1e-12;  // of the largest extent squared, as for a triangle
  const auto point = [&](std::size_t i) -> const Vector3& {
    return surface.points[static_cast<std::size_t>(corners[i])];
  };
  double area = 0;
  double extent = 0;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Vector3 first = point(i - 1) - point(0);
    const Vector3 second = point(i) - point(0);
    area = std::max(area, first.cross(second).norm());
    extent = std::max({extent, first.squaredNorm(), second.squaredNorm()});
  }
  return !(area > kNoArea * extent);
}

void add_fan(FileSurface& surface, const std::vector<std::int64_t>& corners) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    surface.triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

void add_as_triangles(FileSurface& surface, const std::vector<std::int64_t>& corners, const std::string& face) {
  const auto count = static_cast<vtkIdType>(corners.size());
  vtkNew<vtkPolygon> polygon;
  polygon->GetPoints()->SetDataTypeToDouble();
  polygon->GetPoints()->SetNumberOfPoints(count);
  polygon->GetPointIds()->SetNumberOfIds(count);
  for (vtkIdType i = 0; i < count; ++i) {
    polygon->GetPointIds()->SetId(i, i);
    polygon->GetPoints()->SetPoint(
        i, surface.points[static_cast<std::size_t>(corners[static_cast<std::size_t>(i)])].data());
  }
  vtkNew<vtkIdList> ears;
  if (polygon->Triangulate(ears) == 0 || ears->GetNumberOfIds() != 3 * (count - 2)) {
    throw InputError(
        fmt::format("{} with {} corners cannot be cut into triangles: it is flat or intersects itself", face, count));
  }
  const auto corner = [&](vtkIdType i) { return corners[static_cast<std::size_t>(ears->GetId(i))]; };
  for (vtkIdType i = 0; i < ears->GetNumberOfIds(); i += 3) {
    surface.triangles.push_back({corner(i), corner(i + 1), corner(i + 2)});
  }
}

}  // namespace

void add_polygons(FileSurface& surface, const std::vector<std::vector<std::int64_t>>& polygons,
                  const std::string& name) {
  const auto points = static_cast<std::int64_t>(surface.points.size());
  surface.triangles.reserve(surface.triangles.size() + polygons.size());
  for (std::size_t f = 0; f < polygons.size(); ++f) {
    const std::vector<std::int64_t>& corners = polygons[f];
    const std::string face = fmt::format("{}: face {}", name, f);
    if (corners.size() > kMostCorners) {
      throw InputError(
          fmt::format("{} has {} corners, at most {} can be cut into triangles", face, corners.size(), kMostCorners));
    }
    if (corners.size() < 3) {
      throw InputError(fmt::format("{} has {} corners, it must have 3 or more", face, corners.size()));
    }
    for (const std::int64_t corner : corners) {
      if (corner < 0 || corner >= points) {
        throw InputError(
            fmt::format("{} names vertex {}, but there are {} vertices (the first is 0)", face, corner, points));
      }
    }
    if (corners.size() == 3 || has_no_area(surface, corners)) {
      add_fan(surface, corners);
    } else {
      add_as_triangles(surface, corners, face);
    }
  }
}

void add_strip(std::vector<std::vector<std::int64_t>>& polygons, std::span<const std::int64_t> corners) {
  constexpr std::int64_t kEnd = -1;
  std::size_t first = 0;  // of the strip
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i] == kEnd) {
      first = i + 1;
    } else if (i >= first + 2) {
      const std::size_t odd = (i - first) % 2;
      const std::int64_t a = corners[i - 2 + odd];
      const std::int64_t b = corners[i - 1 - odd];
      const std::int64_t c = corners[i];
      if (a != b && b != c && c != a) {
        polygons.push_back({a, b, c});
      }
    }
  }
}

}  // namespace touchfield
