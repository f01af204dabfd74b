#include "sim/mesh/io/mesh_files.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <system_error>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolygon.h>
#include <vtkXMLPolyDataWriter.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

struct Format {
  const char* ending;
  FileSurface (*parse)(const std::string& content, const std::string& name);  // null: is only written
  std::string (*as_file)(const TriangleMesh& mesh, double unit);              // null: is only read
  const char* unit = "";                                                      // that it prescribes; empty: none
};

constexpr std::array<Format, 6> kFormats = {
    {{".stl", parse_stl, as_stl},
     {".obj", parse_obj, as_obj},
     {".ply", parse_ply, [](const auto& mesh, double unit) { return as_ply(mesh, unit); }},
     {".off", parse_off, as_off},
     {".vtp", nullptr, as_vtp},
     {".glb", parse_glb, nullptr, "m"}}};

/// Null where there is none of the path's ending.
const Format* find_format(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto* found =
      std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) { return format.ending == ending; });
  return found != kFormats.end() ? found : nullptr;
}

const Format& format_of(const std::string& path) {
  const Format* const found = find_format(path);
  require(found != nullptr,
          "{}: a mesh file must end in .stl, .obj, .ply, .off, .vtp (only written) or .glb (only read)", path);
  return *found;
}

void require_unit(double unit) {
  require(unit > 0 && std::isfinite(unit), "mesh.unit = {} m must be > 0 and finite", unit);
}

std::string content_of(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  require(!fs::is_directory(status), "{}: is a directory, not a mesh file", path);
  require(!fs::exists(status) || fs::is_regular_file(status), "{}: cannot be read as a file", path);
  if (const std::uintmax_t size = fs::file_size(path, error); !error && size > std::uintmax_t{kMostFileBytes}) {
    throw InputError(fmt::format("{}: {} bytes, a mesh file may have at most {}", path, size, kMostFileBytes));
  }
  std::string content = read_whole_file(path, kMostFileBytes);
  require(!content.empty(), "{}: the file is empty", path);
  return content;
}

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

std::string format_unit(const std::string& path) {
  const Format* const format = find_format(path);
  return format != nullptr ? format->unit : "";
}

void require_few(std::int64_t points, std::int64_t faces, const std::string& name) {
  require(points <= kMostFilePoints && faces <= kMostFileFaces,
          "{}: {} points and {} faces, a mesh file may have at most {} and {}", name, points, faces, kMostFilePoints,
          kMostFileFaces);
}

std::string bytes_behind_text(std::size_t bytes) {
  return fmt::format("{} behind the last face {} ignored", bytes == 1 ? "1 byte" : fmt::format("{} bytes", bytes),
                     bytes == 1 ? "is" : "are");
}

FileSurface read_surface(const std::string& path) {
  const Format& format = format_of(path);
  require(format.parse != nullptr,
          "{}: VTP is only written; save the file as PLY (ParaView does), or repeat `touchfield fit`, which writes PLY",
          path);
  const std::string content = content_of(path);
  FileSurface surface = format.parse(content, path);
  require(!surface.triangles.empty(), "{}: the file has no face", path);
  require_few(static_cast<std::int64_t>(surface.points.size()), static_cast<std::int64_t>(surface.triangles.size()),
              path);
  return surface;
}

TriangleMesh read_mesh(const std::string& path, double unit) {
  require_unit(unit);
  const FileSurface surface = read_surface(path);
  const auto [number, vertices] = merged(surface.points);
  Triangles triangles(3, static_cast<Eigen::Index>(surface.triangles.size()));
  for (std::size_t f = 0; f < surface.triangles.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      triangles(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(f)) =
          number[static_cast<std::size_t>(surface.triangles[f][c])];
    }
  }
  try {
    return {vertices * unit, std::move(triangles)};
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", path, error.what()));
  }
}

void write_mesh(const std::string& path, const TriangleMesh& mesh, double unit) {
  require_unit(unit);
  const Format& format = format_of(path);
  if (format.as_file == nullptr) {
    throw InputError(fmt::format("{}: {} is only read; write .stl, .obj, .ply, .off or .vtp", path, format.ending));
  }
  write_atomically(path, {format.as_file(mesh, unit)});
}

std::pair<std::vector<int>, Points> merged(const std::vector<Vector3>& points) {
  const auto before = [&](std::size_t i, std::size_t j) {
    return std::lexicographical_compare(points[i].begin(), points[i].end(), points[j].begin(), points[j].end());
  };
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), before);
  std::vector<std::size_t> first(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool repeated = i > 0 && !before(order[i - 1], order[i]);
    first[order[i]] = repeated ? first[order[i - 1]] : order[i];
  }
  std::vector<int> number(points.size());
  Points unique(3, static_cast<Eigen::Index>(points.size()));
  int count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (first[i] == i) {
      number[i] = count;
      unique.col(count++) = points[i];
    } else {
      number[i] = number[first[i]];
    }
  }
  unique.conservativeResize(3, count);
  return {std::move(number), std::move(unique)};
}

WeldedSurface welded(const FileSurface& surface, double unit) {
  std::vector<int> place(surface.points.size(), -1);  // among the points that a triangle names
  for (const auto& triangle : surface.triangles) {
    for (const std::int64_t v : triangle) {
      place[static_cast<std::size_t>(v)] = 0;
    }
  }
  std::vector<Vector3> named;
  for (std::size_t v = 0; v < place.size(); ++v) {
    if (place[v] == 0) {
      place[v] = static_cast<int>(named.size());
      named.push_back(surface.points[v] * unit);
    }
  }
  auto [number, points] = merged(named);
  WeldedSurface result;
  result.unreferenced = static_cast<Eigen::Index>(place.size() - named.size());
  result.welded = static_cast<Eigen::Index>(named.size()) - points.cols();
  result.points = std::move(points);
  result.triangles.resize(3, static_cast<Eigen::Index>(surface.triangles.size()));
  Eigen::Index count = 0;
  for (const auto& triangle : surface.triangles) {
    Eigen::Vector3i face;
    for (std::size_t c = 0; c < 3; ++c) {
      face(static_cast<Eigen::Index>(c)) =
          number[static_cast<std::size_t>(place[static_cast<std::size_t>(triangle[c])])];
    }
    if (face(0) == face(1) || face(1) == face(2) || face(2) == face(0)) {
      ++result.collapsed_faces;
    } else {
      result.triangles.col(count++) = face;
    }
  }
  result.triangles.conservativeResize(3, count);
  return result;
}

Triangles without_duplicates(const Triangles& triangles) {
  struct Entry {
    std::array<int, 3> sorted;
    Eigen::Index face;
  };
  std::vector<Entry> entries;
  for (Eigen::Index f = 0; f < triangles.cols(); ++f) {
    Entry& entry = entries.emplace_back(Entry{{triangles(0, f), triangles(1, f), triangles(2, f)}, f});
    std::ranges::sort(entry.sorted);
  }
  std::ranges::stable_sort(entries, [](const Entry& e, const Entry& g) { return e.sorted < g.sorted; });
  std::vector<bool> is_kept(entries.size(), false);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    is_kept[static_cast<std::size_t>(entries[i].face)] = i == 0 || entries[i].sorted != entries[i - 1].sorted;
  }
  return faces_where(triangles, [&](Eigen::Index f) { return is_kept[static_cast<std::size_t>(f)]; });
}

void add_polygons(FileSurface& surface, const std::vector<std::vector<std::int64_t>>& polygons,
                  const std::string& name) {
  const auto points = static_cast<std::int64_t>(surface.points.size());
  surface.triangles.reserve(surface.triangles.size() + polygons.size());
  for (std::size_t f = 0; f < polygons.size(); ++f) {
    const std::vector<std::int64_t>& corners = polygons[f];
    const std::string face = fmt::format("{}: face {}", name, f);
    require(corners.size() <= kMostCorners, "{} has {} corners, at most {} can be cut into triangles", face,
            corners.size(), kMostCorners);
    require(corners.size() >= 3, "{} has {} corners, it must have 3 or more", face, corners.size());
    for (const std::int64_t corner : corners) {
      require(corner >= 0 && corner < points, "{} names vertex {}, but there are {} vertices (the first is 0)", face,
              corner, points);
    }
    if (corners.size() == 3 || has_no_area(surface, corners)) {
      for (std::size_t i = 2; i < corners.size(); ++i) {
        surface.triangles.push_back({corners[0], corners[i - 1], corners[i]});
      }
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

std::string as_vtp(const TriangleMesh& mesh, double unit) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto& vertex : mesh.vertices().colwise()) {
    points->InsertNextPoint(vertex.x() / unit, vertex.y() / unit, vertex.z() / unit);
  }
  vtkNew<vtkCellArray> faces;
  for (const auto& triangle : mesh.triangles().colwise()) {
    faces->InsertNextCell({triangle(0), triangle(1), triangle(2)});
  }
  vtkNew<vtkPolyData> surface;
  surface->SetPoints(points);
  surface->SetPolys(faces);
  // Inline binary: ParaView 5.11 of Debian 12 cannot open the appended mode that is the writer's default.
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(surface);
  writer->SetDataModeToBinary();
  writer->SetCompressorTypeToZLib();
  writer->WriteToOutputStringOn();
  if (writer->Write() != 1) {
    throw IoError("the mesh could not be encoded as VTP");
  }
  return writer->GetOutputString();
}

}  // namespace touchfield
