#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What a mesh file says, in its own units and numbering. Readers see to it that coordinates are finite, triangles name
/// points that are there, and there are no more of both than require_few() allows.
struct FileSurface {
  std::vector<Vector3> points;
  std::vector<std::array<std::int64_t, 3>> triangles;  // numbers of points
  std::vector<std::string> notes;                      // what of the file was left out, a line each
};

/// The most that a file may hold. A detailed scan has a million faces; beyond five no remeshing here goes, and a file
/// that announces more is damaged or means harm. STL gives every face three points of its own.
inline constexpr std::int64_t kMostFileFaces = 5'000'000;
inline constexpr std::int64_t kMostFilePoints = 3 * kMostFileFaces;
inline constexpr std::int64_t kMostFileCorners = 3 * kMostFileFaces;   // a polygon of n corners makes n - 2 faces
inline constexpr std::int64_t kMostFileBytes = std::int64_t{1} << 30;  // four million faces of an STL as text

/// Refuses what a file announces before memory is taken for it.
/// throws   InputError "name: ..." on more points or faces than that
void require_few(std::int64_t points, std::int64_t faces, const std::string& name);

/// Each takes a file's whole content; `name` is how messages call the file. Coordinates are read in double precision.
///
/// throws   InputError with line or byte if the content is cut short, is of another kind, or has a coordinate that is
///          not a finite number or a corner that is not a point
FileSurface parse_stl(const std::string& content, const std::string& name);
FileSurface parse_obj(const std::string& content, const std::string& name);
FileSurface parse_ply(const std::string& content, const std::string& name);
FileSurface parse_off(const std::string& content, const std::string& name);
/// Of binary glTF 2.0: the triangles of all nodes of the scene, in metres. Each is where its node or its bones put it
/// at rest, morphed by its default weights. A file that needs an extension that changes the shape is refused by its
/// name, except KHR_mesh_quantization. No other file is opened.
FileSurface parse_glb(const std::string& content, const std::string& name);

/// The unit that a file's format prescribes, by the path's ending: "m" of GLB. Empty: none.
std::string format_unit(const std::string& path);

/// Adds polygons as triangles, once all points are known. A polygon of four corners or more need not be convex. A
/// polygon without area becomes triangles without area.
///
/// polygons   corners as numbers of the surface's points
/// throws     InputError "name: face ..." on fewer than 3 corners or more than 5000, a corner that is not a point, or a
///            polygon that cuts itself
void add_polygons(FileSurface& surface, const std::vector<std::vector<std::int64_t>>& polygons,
                  const std::string& name);

std::string bytes_behind_text(std::size_t bytes);

/// Adds a strip's triangles to polygons. Each corner from the third on makes a triangle with the two before it. Every
/// other triangle runs the other way round. A corner of -1 ends the strip and begins another. Triangles that name a
/// point twice only join strips and are left out.
void add_strip(std::vector<std::vector<std::int64_t>>& polygons, std::span<const std::int64_t> corners);

/// A number for each face of a mesh, by name; NaN where there is none.
using FaceNumbers = std::vector<std::pair<std::string, Eigen::VectorXd>>;

/// A mesh as the content of a file, in file units of `unit` metres. STL and PLY are binary, OFF and OBJ are text. VTP
/// has its arrays inline and compressed. PLY keeps `numbers` as properties of its faces.
std::string as_stl(const TriangleMesh& mesh, double unit);
std::string as_obj(const TriangleMesh& mesh, double unit);
std::string as_ply(const TriangleMesh& mesh, double unit, const FaceNumbers& numbers = {});
std::string as_off(const TriangleMesh& mesh, double unit);
std::string as_vtp(const TriangleMesh& mesh, double unit);

/// Reads the points and triangles of an STL (ASCII or binary), OBJ, PLY, OFF or GLB file, in its own units. The
/// ending of the path tells the format. No point or triangle is merged or left out, except triangles that only join
/// strips. Polygons are cut into triangles.
///
/// throws    InputError if the file is missing, unreadable, damaged, of another kind, larger than mesh_files.h allows,
///           or has no face; the message names the file
FileSurface read_surface(const std::string& path);

/// Reads a surface as a mesh.
///
/// unit      metres per file unit, e.g. 1e-3 for a file in millimetres
/// returns   the mesh; vertices with equal coordinates are merged (STL has no shared vertices). No other repair.
/// throws    InputError as read_surface, or if it is not a mesh (see TriangleMesh)
TriangleMesh read_mesh(const std::string& path, double unit);

/// Writes STL (binary), OBJ, PLY (binary), OFF or VTP by the ending of the path, in file units of `unit` metres.
/// The file appears whole or not at all.
/// throws   InputError on another ending, IoError if it cannot be written
void write_mesh(const std::string& path, const TriangleMesh& mesh, double unit);

/// For each point the number of the first one with its coordinates, counting only first ones; and these.
std::pair<std::vector<int>, Points> merged(const std::vector<Vector3>& points);

/// A file's surface as points [m] and triangles of three distinct points each, and what that took.
struct WeldedSurface {
  Points points;
  Triangles triangles;
  Eigen::Index unreferenced = 0;     // points that no triangle named, left out
  Eigen::Index welded = 0;           // points with the coordinates of an earlier one, which replaces them
  Eigen::Index collapsed_faces = 0;  // triangles with two corners in one point, left out
};

/// Merges points of a file's surface that have equal coordinates and leaves out what names none.
///
/// unit   metres per file unit, > 0
WeldedSurface welded(const FileSurface& surface, double unit);

/// The triangles without those that have the corners of an earlier one, in whatever order.
Triangles without_duplicates(const Triangles& triangles);

}  // namespace touchfield
