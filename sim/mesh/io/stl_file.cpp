#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

namespace {

constexpr std::size_t kHeader = 84;  // bytes: a comment of 80 and the number of faces
constexpr std::size_t kFace = 50;    // bytes: normal and corners as 12 floats, an attribute of 2

std::uint32_t announced_faces(const std::string& content) {
  return number_at<std::uint32_t>(content.data() + 80, false);
}

void add_face(FileSurface& surface, const std::array<Vector3, 3>& corners) {
  const auto first = static_cast<std::int64_t>(surface.points.size());
  surface.points.insert(surface.points.end(), corners.begin(), corners.end());
  surface.triangles.push_back({first, first + 1, first + 2});
}

FileSurface parse_binary(const std::string& content, const std::string& name) {
  FileSurface surface;
  const std::size_t faces = announced_faces(content);
  require_few(static_cast<std::int64_t>(3 * faces), static_cast<std::int64_t>(faces), name);
  surface.points.reserve(3 * faces);
  surface.triangles.reserve(faces);
  for (std::size_t f = 0; f < faces; ++f) {
    std::array<float, 12> values{};
    std::memcpy(values.data(), content.data() + kHeader + f * kFace, sizeof values);
    std::array<Vector3, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
      corners[c] = Vector3(values[3 * c + 3], values[3 * c + 4], values[3 * c + 5]);
      if (!corners[c].allFinite()) {
        throw InputError(fmt::format("{}: face {} has a coordinate that is not a finite number ({})", name, f,
                                     fmt::format("{}, {}, {}", corners[c].x(), corners[c].y(), corners[c].z())));
      }
    }
    add_face(surface, corners);
  }
  return surface;
}

std::string lower_case(std::string_view word) {
  std::string lower(word);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
}

void expect(TextCursor& cursor, std::string_view word, const char* expected) {
  if (lower_case(word) != expected) {
    cursor.fail(word.empty() ? fmt::format("the file ends where '{}' is expected", expected)
                             : fmt::format("'{}' where '{}' is expected", word.substr(0, 40), expected));
  }
}

Vector3 parse_vertex(TextCursor& cursor) {
  expect(cursor, cursor.next_word(), "vertex");
  Vector3 vertex;
  for (double& coordinate : vertex) {
    coordinate = cursor.number("a coordinate");
    if (!std::isfinite(coordinate)) {
      cursor.fail(fmt::format("a coordinate is {}, it must be a finite number", coordinate));
    }
  }
  return vertex;
}

FileSurface parse_text(const std::string& content, const std::string& name) {
  FileSurface surface;
  TextCursor cursor(content, name);
  std::string_view rest_of_line;
  for (std::string_view word = cursor.next_word(); !word.empty(); word = cursor.next_word()) {
    expect(cursor, word, "solid");
    cursor.next_line(rest_of_line);
    for (word = cursor.next_word(); lower_case(word) == "facet"; word = cursor.next_word()) {
      expect(cursor, cursor.next_word(), "normal");
      for (int i = 0; i < 3; ++i) {
        cursor.next_word();  // not used, and of a face without area no number that all programs spell alike
      }
      expect(cursor, cursor.next_word(), "outer");
      expect(cursor, cursor.next_word(), "loop");
      std::array<Vector3, 3> corners;
      for (Vector3& corner : corners) {
        corner = parse_vertex(cursor);
      }
      expect(cursor, cursor.next_word(), "endloop");
      expect(cursor, cursor.next_word(), "endfacet");
      add_face(surface, corners);
      require_few(static_cast<std::int64_t>(surface.points.size()), static_cast<std::int64_t>(surface.triangles.size()),
                  name);
    }
    expect(cursor, word, "endsolid");
    cursor.next_line(rest_of_line);
  }
  return surface;
}

/// What follows the last face that a binary file announces is passed over: colours, or what some programs pad with.
FileSurface parse_longer(const std::string& content, const std::string& name) {
  const std::size_t faces = announced_faces(content);
  const std::size_t end = kHeader + kFace * faces;
  const std::size_t behind = content.size() - end;
  if (behind % kFace == 0 && content.find_first_not_of('\0', end) != std::string::npos) {
    throw InputError(
        fmt::format("{}: its header announces {} faces, but there are {} more behind them; the header is damaged", name,
                    faces, behind / kFace));
  }
  FileSurface surface = parse_binary(content, name);
  surface.notes.push_back(bytes_behind_text(behind));
  return surface;
}

}  // namespace

FileSurface parse_stl(const std::string& content, const std::string& name) {
  const bool has_header = content.size() >= kHeader;
  const std::size_t announced = has_header ? kHeader + kFace * announced_faces(content) : 0;
  if (has_header && content.size() == announced) {
    return parse_binary(content, name);
  }
  std::string_view start = std::string_view(content).substr(after_mark(content));
  const bool text = lower_case(take_word(start)) == "solid" && content.find('\0') == std::string::npos;
  if (text) {
    return parse_text(content, name);
  }
  require(has_header, "{}: not an STL file: it neither begins with 'solid' nor has the {} bytes of a binary header",
          name, kHeader);
  if (content.size() > announced && announced > kHeader) {
    return parse_longer(content, name);
  }
  throw InputError(
      fmt::format("{}: not a whole binary STL file: its header announces {} faces, which take {} bytes, but it has {}",
                  name, announced_faces(content), announced, content.size()));
}

std::string as_stl(const TriangleMesh& mesh, double unit) {
  std::string bytes = "binary STL";
  bytes.resize(80, ' ');
  append_bytes(bytes, static_cast<std::uint32_t>(mesh.face_count()));
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    append_bytes<float>(bytes, mesh.normals().col(f));
    for (int c = 0; c < 3; ++c) {
      append_bytes<float>(bytes, mesh.corner(f, c) / unit);
    }
    append_bytes(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace touchfield
