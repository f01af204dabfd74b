#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/text_cursor.h"

namespace touchfield {

namespace {

/// Corners are "v", "v/vt", "v//vn" or "v/vt/vn"; v counts from 1, or backwards from the last vertex if negative.
std::vector<std::int64_t> parse_face(TextCursor& cursor, std::string_view line, std::size_t vertices) {
  std::vector<std::int64_t> corners;
  for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
    std::int64_t number = 0;
    if (!to_integer(word.substr(0, word.find('/')), number) || number == 0) {
      cursor.fail(
          fmt::format("a corner of a face is '{}', it must begin with a vertex number from 1", word.substr(0, 40)));
    }
    corners.push_back(number > 0 ? number - 1 : number + static_cast<std::int64_t>(vertices));
    if (corners.back() < 0) {
      cursor.fail(fmt::format("a corner of a face is {}, but only {} vertices come before it", number, vertices));
    }
  }
  return corners;
}

}  // namespace

FileSurface parse_obj(const std::string& content, const std::string& name) {
  FileSurface surface;
  std::vector<std::vector<std::int64_t>> polygons;
  TextCursor cursor(content, name);
  for (std::string_view line; cursor.next_line(line);) {
    const std::string_view keyword = take_word(line);
    if (keyword == "v") {
      surface.points.push_back(take_point(cursor, line));
    } else if (keyword == "f") {
      polygons.push_back(parse_face(cursor, line, surface.points.size()));
    }
    require_few(static_cast<std::int64_t>(surface.points.size()), static_cast<std::int64_t>(polygons.size()), name);
    // Groups, materials, normals and textures do not matter to the surface.
  }
  add_polygons(surface, polygons, name);
  return surface;
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

}  // namespace touchfield
