#include "sim/mesh/mesh_io.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/mesh_files.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

enum class Format { kStl, kObj, kPly };

Format format_of(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".stl") {
    return Format::kStl;
  }
  if (ending == ".obj") {
    return Format::kObj;
  }
  if (ending == ".ply") {
    return Format::kPly;
  }
  throw InputError(fmt::format("{}: a mesh file must end in .stl, .obj or .ply", path));
}

void require_unit(double unit) {
  if (!(unit > 0) || !std::isfinite(unit)) {
    throw InputError(fmt::format("mesh.unit = {} m must be > 0 and finite", unit));
  }
}

std::string content_of(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) {
    throw InputError(fmt::format("{}: no such file", path));
  }
  if (status.type() == fs::file_type::directory) {
    throw InputError(fmt::format("{}: is a directory, not a mesh file", path));
  }
  if (error || status.type() != fs::file_type::regular) {
    throw InputError(fmt::format("{}: cannot be read as a file", path));
  }
  std::ifstream file(path, std::ios::binary);
  std::string content(std::istreambuf_iterator<char>(file), {});
  if (!file.is_open() || file.bad()) {
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  if (content.empty()) {
    throw InputError(fmt::format("{}: the file is empty", path));
  }
  return content;
}

FileSurface parse(Format format, const std::string& content, const std::string& path) {
  switch (format) {
    case Format::kStl:
      return parse_stl(content, path);
    case Format::kObj:
      return parse_obj(content, path);
    case Format::kPly:
      break;
  }
  return parse_ply(content, path);
}

/// For each point the number of the first one with its coordinates, counting only first ones; and these.
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

static_assert(std::endian::native == std::endian::little,
              "binary STL and PLY are written as the numbers lie in memory");

template <class Number>
void append(std::string& bytes, Number value) {
  const auto* first = reinterpret_cast<const char*>(&value);
  bytes.append(first, sizeof value);
}

template <class Number>
void append(std::string& bytes, const Vector3& vector) {
  for (const double component : vector) {
    append(bytes, static_cast<Number>(component));
  }
}

std::string as_stl(const TriangleMesh& mesh, double unit) {
  std::string bytes = "binary STL";
  bytes.resize(80, ' ');
  append(bytes, static_cast<std::uint32_t>(mesh.face_count()));
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    append<float>(bytes, mesh.normals().col(f));
    for (int c = 0; c < 3; ++c) {
      append<float>(bytes, mesh.corner(f, c) / unit);
    }
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

std::string as_obj(const TriangleMesh& mesh, double unit) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  for (const auto& vertex : mesh.vertices().colwise()) {
    fmt::format_to(out, "v {} {} {}\n", vertex.x() / unit, vertex.y() / unit, vertex.z() / unit);
  }
  for (const auto& triangle : mesh.triangles().colwise()) {
    fmt::format_to(out, "f {} {} {}\n", triangle(0) + 1, triangle(1) + 1, triangle(2) + 1);
  }
  return fmt::to_string(text);
}

std::string as_ply(const TriangleMesh& mesh, double unit) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertex_count(), mesh.face_count());
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    append<double>(bytes, mesh.vertices().col(v) / unit);
  }
  for (const auto& triangle : mesh.triangles().colwise()) {
    append(bytes, std::uint8_t{3});
    for (const int v : triangle) {
      append(bytes, static_cast<std::int32_t>(v));
    }
  }
  return bytes;
}

std::string as_file(Format format, const TriangleMesh& mesh, double unit) {
  switch (format) {
    case Format::kStl:
      return as_stl(mesh, unit);
    case Format::kObj:
      return as_obj(mesh, unit);
    case Format::kPly:
      break;
  }
  return as_ply(mesh, unit);
}

}  // namespace

TriangleMesh read_mesh(const std::string& path, double unit) {
  require_unit(unit);
  const Format format = format_of(path);
  const FileSurface surface = parse(format, content_of(path), path);
  if (surface.triangles.empty()) {
    throw InputError(fmt::format("{}: the file has no face", path));
  }
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
  const std::string content = as_file(format_of(path), mesh, unit);
  const std::string unfinished = fmt::format("{}.{}.part", path, getpid());
  std::error_code error;
  {
    std::ofstream file(unfinished, std::ios::binary);
    file.write(content.data(), static_cast<std::streamsize>(content.size()));
    file.close();
    if (!file) {
      const std::string reason = std::strerror(errno);
      fs::remove(unfinished, error);
      throw IoError(fmt::format("{}: cannot be written: {}", path, reason));
    }
  }
  fs::rename(unfinished, path, error);
  if (error) {
    const std::string reason = error.message();
    fs::remove(unfinished, error);
    throw IoError(fmt::format("{}: cannot be written: {}", path, reason));
  }
}

}  // namespace touchfield
