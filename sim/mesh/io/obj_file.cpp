#include <cmath>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/text.h"
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

/// The statement that begins with a line, without its comment: a backslash at its end joins the next line. Others than
/// vertices and faces may end with one, as names and paths do.
std::string_view statement(TextCursor& cursor, std::string_view line, std::string& joined) {
  const auto shortened = [](std::string_view text) {
    text = without_comment(text);
    return text.substr(0, text.find_last_not_of(" \t") + 1);
  };
  std::string_view text = shortened(line);
  if (!text.ends_with('\\')) {
    return text;
  }
  joined.clear();
  for (bool more = true; more;) {
    more = text.ends_with('\\');
    joined += text.substr(0, text.size() - (more ? 1 : 0));
    joined += ' ';
    more = more && cursor.next_line(line);
    text = shortened(line);
  }
  return joined;
}

}  // namespace

FileSurface parse_obj(const std::string& content, const std::string& name) {
  FileSurface surface;
  std::vector<std::vector<std::int64_t>> polygons;
  TextCursor cursor(content, name);
  std::string joined;
  for (std::string_view line; cursor.next_line(line);) {
    const std::string_view keyword = take_word(line);
    if (keyword == "v") {
      surface.points.push_back(take_point(cursor, statement(cursor, line, joined)));
    } else if (keyword == "f") {
      polygons.push_back(parse_face(cursor, statement(cursor, line, joined), surface.points.size()));
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
