#include "sim/mesh/io/mesh_io.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/mesh/io/weld.h"

namespace touchfield {

namespace {

namespace fs = std::filesystem;

struct Format {
  const char* ending;
  FileSurface (*parse)(const std::string& content, const std::string& name);  // null: is only written
  std::string (*as_file)(const TriangleMesh& mesh, double unit);              // null: is only read
};

constexpr std::array<Format, 6> kFormats = {
    {{".stl", parse_stl, as_stl},
     {".obj", parse_obj, as_obj},
     {".ply", parse_ply, [](const auto& mesh, double unit) { return as_ply(mesh, unit); }},
     {".off", parse_off, as_off},
     {".vtp", nullptr, as_vtp},
     {".glb", parse_glb, nullptr}}};

const Format& format_of(const std::string& path) {
  std::string ending = fs::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto* found =
      std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) { return format.ending == ending; });
  if (found == kFormats.end()) {
    throw InputError(fmt::format(
        "{}: a mesh file must end in .stl, .obj, .ply, .off, .vtp (only written) or .glb (only read)", path));
  }
  return *found;
}

void require_unit(double unit) {
  if (!(unit > 0) || !std::isfinite(unit)) {
    throw InputError(fmt::format("mesh.unit = {} m must be > 0 and finite", unit));
  }
}

std::string content_of(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) {
    throw InputError(fmt::format("{}: is a directory, not a mesh file", path));
  }
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw InputError(fmt::format("{}: cannot be read as a file", path));
  }
  if (const std::uintmax_t size = fs::file_size(path, error); !error && size > std::uintmax_t{kMostFileBytes}) {
    throw InputError(fmt::format("{}: {} bytes, a mesh file may have at most {}", path, size, kMostFileBytes));
  }
  std::string content = read_whole_file(path, kMostFileBytes);
  if (content.empty()) {
    throw InputError(fmt::format("{}: the file is empty", path));
  }
  return content;
}

}  // namespace

void require_few(std::int64_t points, std::int64_t faces, const std::string& name) {
  if (points > kMostFilePoints || faces > kMostFileFaces) {
    throw InputError(fmt::format("{}: {} points and {} faces, a mesh file may have at most {} and {}", name, points,
                                 faces, kMostFilePoints, kMostFileFaces));
  }
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
  if (surface.triangles.empty()) {
    throw InputError(fmt::format("{}: the file has no face", path));
  }
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

}  // namespace touchfield
