#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/io/mesh_files.h"

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

/// The next line that says something, without its comment; empty at the end of the text.
std::string_view next_statement(TextCursor& cursor) {
  for (std::string_view line; cursor.next_line(line);) {
    line = without_comment(line);
    std::string_view rest = line;
    if (!take_word(rest).empty()) {
      return line;
    }
  }
  return {};
}

std::string_view required_statement(TextCursor& cursor, const char* what, std::int64_t number, std::int64_t count) {
  const std::string_view line = next_statement(cursor);
  if (line.empty()) {
    cursor.fail(fmt::format("the file ends after {} of its {} {}", number, count, what));
  }
  return line;
}

/// The keyword [ST][C][N][4][n]OFF. What the letters add stands behind a vertex' coordinates and does not matter, but
/// 4 and n change what these are. Returns what follows the keyword in its line, with or without a blank.
std::string_view parse_keyword(TextCursor& cursor) {
  std::string_view line = next_statement(cursor);
  const std::string_view word = take_word(line);
  std::string_view letters = word;
  for (const std::string_view letter : {"ST", "C", "N"}) {
    letters.remove_prefix(letters.starts_with(letter) ? letter.size() : 0);
  }
  if (letters == "4OFF" || letters == "nOFF" || letters == "4nOFF") {
    cursor.fail(fmt::format("'{}' has points that are not in three dimensions, OFF is needed", word));
  }
  if (!letters.starts_with("OFF") || letters.find_first_not_of("0123456789", 3) != std::string_view::npos) {
    cursor.fail(
        fmt::format("not an OFF file: it begins with '{}', not with OFF, COFF, NOFF or STOFF", word.substr(0, 40)));
  }
  std::string_view rest = line;
  if (take_word(rest) == "BINARY") {
    cursor.fail("binary OFF is not supported, only text");
  }
  line = {letters.data() + 3, line.data() + line.size()};
  return line;
}

std::int64_t parse_count(TextCursor& cursor, std::string_view& line, const char* what) {
  const std::string_view word = take_word(line);
  std::int64_t count = 0;
  if (!to_integer(word, count) || count < 0) {
    cursor.fail(fmt::format("the number of {} is '{}', it must be a whole number from 0", what, word.substr(0, 40)));
  }
  return count;
}

/// "n v1 ... vn", then perhaps a colour.
std::vector<std::int64_t> parse_face(TextCursor& cursor, std::string_view line) {
  const std::int64_t count = parse_count(cursor, line, "corners of a face");
  std::vector<std::int64_t> corners;
  while (static_cast<std::int64_t>(corners.size()) < count) {
    const std::string_view word = take_word(line);
    if (word.empty()) {
      cursor.fail(fmt::format("a face announces {} corners, but has {}", count, corners.size()));
    }
    std::int64_t corner = 0;
    if (!to_integer(word, corner)) {
      cursor.fail(fmt::format("a corner of a face is '{}', it must be a vertex number from 0", word.substr(0, 40)));
    }
    corners.push_back(corner);
  }
  return corners;
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

FileSurface parse_off(const std::string& content, const std::string& name) {
  TextCursor cursor(content, name);
  std::string_view counts = parse_keyword(cursor);
  std::string_view rest = counts;
  if (take_word(rest).empty()) {
    counts = next_statement(cursor);
  }
  const std::int64_t vertices = parse_count(cursor, counts, "vertices");
  const std::int64_t faces = parse_count(cursor, counts, "faces");  // a number of edges may follow
  require_few(vertices, faces, name);
  FileSurface surface;
  for (std::int64_t i = 0; i < vertices; ++i) {
    surface.points.push_back(take_point(cursor, required_statement(cursor, "vertices", i, vertices)));
  }
  std::vector<std::vector<std::int64_t>> polygons;
  for (std::int64_t i = 0; i < faces; ++i) {
    polygons.push_back(parse_face(cursor, required_statement(cursor, "faces", i, faces)));
  }
  if (!next_statement(cursor).empty()) {
    cursor.fail(fmt::format("the file continues after its {} vertices and {} faces", vertices, faces));
  }
  add_polygons(surface, polygons, name);
  return surface;
}

std::string as_off(const TriangleMesh& mesh, double unit) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "OFF\n{} {} 0\n", mesh.vertex_count(), mesh.face_count());
  for (const auto& vertex : mesh.vertices().colwise()) {
    fmt::format_to(out, "{} {} {}\n", vertex.x() / unit, vertex.y() / unit, vertex.z() / unit);
  }
  for (const auto& triangle : mesh.triangles().colwise()) {
    fmt::format_to(out, "3 {} {} {}\n", triangle(0), triangle(1), triangle(2));
  }
  return fmt::to_string(text);
}

}  // namespace touchfield
