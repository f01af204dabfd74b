#pragma once

#include <utility>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A mesh as a file in metres would say it.
inline FileSurface file_of(const TriangleMesh& mesh) {
  FileSurface surface;
  for (const auto& point : mesh.vertices().colwise()) {
    surface.points.emplace_back(point);
  }
  for (const auto& face : mesh.triangles().colwise()) {
    surface.triangles.push_back({face(0), face(1), face(2)});
  }
  return surface;
}

/// Two surfaces in one file, nothing merged.
inline FileSurface together(FileSurface one, const FileSurface& other) {
  const auto first = static_cast<std::int64_t>(one.points.size());
  one.points.insert(one.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles) {
    one.triangles.push_back({a + first, b + first, c + first});
  }
  return one;
}

/// Every face with three points of its own, as STL has it.
inline FileSurface soup_of(const FileSurface& surface) {
  FileSurface soup;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto first = static_cast<std::int64_t>(soup.points.size());
    for (const std::int64_t v : {a, b, c}) {
      soup.points.push_back(surface.points[static_cast<std::size_t>(v)]);
    }
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

inline FileSurface turned(FileSurface surface) {
  for (auto& triangle : surface.triangles) {
    std::swap(triangle[1], triangle[2]);
  }
  return surface;
}

inline FileSurface without_face(FileSurface surface, std::ptrdiff_t face) {
  surface.triangles.erase(surface.triangles.begin() + face);
  return surface;
}

/// Cube with corners at 0 and 10 mm [m]: corner number x + 2 y + 4 z. Its sides' diagonals meet at corners 0, 3, 5, 6.
inline TriangleMesh cube(const Vector3& at = Vector3::Zero()) {
  Points vertices(3, 8);
  for (int i = 0; i < 8; ++i) {
    vertices.col(i) = at + 0.01 * Eigen::Vector3i(i % 2, i / 2 % 2, i / 4).cast<double>();
  }
  Triangles triangles(3, 12);
  triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      3, 2, 5, 7, 1, 5, 7, 6, 6, 4, 3, 7,           //
      1, 3, 7, 6, 5, 4, 3, 7, 2, 6, 7, 5;
  return {vertices, triangles};
}

}  // namespace touchfield
