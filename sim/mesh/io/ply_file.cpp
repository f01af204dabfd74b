#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

namespace {

enum class Encoding { kText, kLittleEndian, kBigEndian };
enum class Scalar { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

struct Property {
  std::string name;
  Scalar type;
  std::optional<Scalar> count_type;  // of a list
};

struct Element {
  std::string name;
  std::int64_t count;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding;
  std::vector<Element> elements;
  std::size_t end;  // where the body begins
};

std::optional<Scalar> scalar_type(std::string_view word) {
  struct Name {
    std::string_view word;
    std::string_view sized;
    Scalar type;
  };
  static constexpr std::array<Name, 8> kNames = {{
      {"char", "int8", Scalar::kInt8},
      {"uchar", "uint8", Scalar::kUint8},
      {"short", "int16", Scalar::kInt16},
      {"ushort", "uint16", Scalar::kUint16},
      {"int", "int32", Scalar::kInt32},
      {"uint", "uint32", Scalar::kUint32},
      {"float", "float32", Scalar::kFloat32},
      {"double", "float64", Scalar::kFloat64},
  }};
  const auto* found = std::find_if(kNames.begin(), kNames.end(),
                                   [&](const Name& name) { return name.word == word || name.sized == word; });
  return found == kNames.end() ? std::nullopt : std::optional(found->type);
}

Scalar required_type(const TextCursor& cursor, std::string_view word) {
  const std::optional<Scalar> type = scalar_type(word);
  if (!type) {
    cursor.fail(fmt::format("'{}' is not a type of a PLY property", word.substr(0, 40)));
  }
  return *type;
}

Encoding parse_format(const TextCursor& cursor, std::string_view word) {
  if (word == "ascii") {
    return Encoding::kText;
  }
  if (word == "binary_little_endian") {
    return Encoding::kLittleEndian;
  }
  if (word == "binary_big_endian") {
    return Encoding::kBigEndian;
  }
  cursor.fail(fmt::format("format '{}' must be ascii, binary_little_endian or binary_big_endian", word.substr(0, 40)));
}

Element parse_element(const TextCursor& cursor, std::string_view line) {
  Element element{std::string(take_word(line)), 0, {}};
  if (!to_integer(take_word(line), element.count) || element.count < 0) {
    cursor.fail(fmt::format("element '{}' must have a number of entries", element.name));
  }
  return element;
}

Property parse_property(const TextCursor& cursor, std::string_view line) {
  const std::string_view first = take_word(line);
  Property property;
  if (first == "list") {
    property.count_type = required_type(cursor, take_word(line));
    property.type = required_type(cursor, take_word(line));
  } else {
    property.type = required_type(cursor, first);
  }
  property.name = std::string(take_word(line));
  return property;
}

Header parse_header(const std::string& content, const std::string& name) {
  TextCursor cursor(content, name);
  std::string_view line;
  if (!cursor.next_line(line) || take_word(line) != "ply") {
    throw InputError(fmt::format("{}: not a PLY file: it does not begin with 'ply'", name));
  }
  std::optional<Encoding> encoding;
  std::vector<Element> elements;
  while (cursor.next_line(line)) {
    const std::string_view keyword = take_word(line);
    if (keyword == "format") {
      encoding = parse_format(cursor, take_word(line));
    } else if (keyword == "element") {
      elements.push_back(parse_element(cursor, line));
    } else if (keyword == "property") {
      if (elements.empty()) {
        cursor.fail("a property before the first element");
      }
      elements.back().properties.push_back(parse_property(cursor, line));
    } else if (keyword == "end_header") {
      if (!encoding) {
        cursor.fail("the header has no 'format'");
      }
      // Where lines end with a carriage return alone, a line feed that follows is the body's.
      const std::size_t end = cursor.position();
      const bool lone_returns = content.compare(content.find_first_of("\r\n"), 2, "\r\n") != 0;
      return {*encoding, std::move(elements), lone_returns && content.compare(end - 2, 2, "\r\n") == 0 ? end - 1 : end};
    } else if (keyword != "comment" && keyword != "obj_info") {
      cursor.fail(fmt::format("'{}' is not a line of a PLY header", keyword.substr(0, 40)));
    }
  }
  cursor.fail("the file ends within its header");
}

/// Hands out the numbers of the body one by one.
class Body {
 public:
  Body(const std::string& content, const std::string& name, const Header& header)
      : content_(content),
        name_(name),
        encoding_(header.encoding),
        cursor_(content, name, header.end),
        at_(header.end) {}

  double next(Scalar type) {
    if (encoding_ == Encoding::kText) {
      return cursor_.number("a value");
    }
    switch (type) {
      case Scalar::kInt8:
        return take<std::int8_t>();
      case Scalar::kUint8:
        return take<std::uint8_t>();
      case Scalar::kInt16:
        return take<std::int16_t>();
      case Scalar::kUint16:
        return take<std::uint16_t>();
      case Scalar::kInt32:
        return take<std::int32_t>();
      case Scalar::kUint32:
        return take<std::uint32_t>();
      case Scalar::kFloat32:
        return static_cast<double>(take<float>());
      case Scalar::kFloat64:
        return take<double>();
    }
    fail("a value of an unknown type");
  }

  std::int64_t next_integer(Scalar type, const char* what) {
    constexpr double kMost = 4294967295.0;
    const double value = next(type);
    if (!(std::abs(value) <= kMost) || value != std::floor(value)) {
      fail(fmt::format("{} is {}, it must be a whole number", what, value));
    }
    return static_cast<std::int64_t>(value);
  }

  /// Passes over a number that does not matter, however it is spelt.
  void pass(Scalar type) {
    if (encoding_ != Encoding::kText) {
      next(type);
    } else if (cursor_.next_word().empty()) {
      fail("the file ends before all its elements are read");
    }
  }

  /// Bytes that are left, from the first that is no blank of a text.
  std::size_t left() {
    if (encoding_ != Encoding::kText) {
      return content_.size() - at_;
    }
    const std::size_t word = cursor_.next_word().size();
    return word == 0 ? 0 : content_.size() - cursor_.position() + word;
  }

  [[noreturn]] void fail(const std::string& message) const {
    if (encoding_ == Encoding::kText) {
      cursor_.fail(message);
    }
    throw InputError(fmt::format("{}: {} (byte {})", name_, message, at_));
  }

 private:
  template <class Number>
  Number take() {
    if (content_.size() - at_ < sizeof(Number)) {
      fail("the file ends before all its elements are read");
    }
    at_ += sizeof(Number);
    return number_at<Number>(content_.data() + at_ - sizeof(Number), encoding_ == Encoding::kBigEndian);
  }

  const std::string& content_;
  const std::string& name_;
  Encoding encoding_;
  TextCursor cursor_;
  std::size_t at_;
};

void skip(Body& body, const Property& property) {
  std::int64_t count = property.count_type ? body.next_integer(*property.count_type, "the length of a list") : 1;
  for (; count > 0; --count) {
    body.pass(property.type);
  }
}

Vector3 parse_vertex(Body& body, const Element& element) {
  Vector3 vertex = Vector3::Zero();
  for (const Property& property : element.properties) {
    const auto axis = std::string_view("xyz").find(property.name);
    if (property.name.size() != 1 || axis == std::string_view::npos || property.count_type) {
      skip(body, property);
      continue;
    }
    const double value = body.next(property.type);
    if (!std::isfinite(value)) {
      body.fail(fmt::format("coordinate {} of a vertex is {}, it must be a finite number", property.name, value));
    }
    vertex(static_cast<Eigen::Index>(axis)) = value;
  }
  return vertex;
}

bool is_corner_list(const Property& property) {
  return property.count_type && (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// The corners of a face or a strip. `left` is how many the file may have.
std::vector<std::int64_t> parse_corners(Body& body, const Element& element, std::int64_t& left) {
  std::vector<std::int64_t> corners;
  for (const Property& property : element.properties) {
    if (!is_corner_list(property)) {
      skip(body, property);
      continue;
    }
    const std::int64_t count = body.next_integer(*property.count_type, "the number of corners of a face");
    left -= std::max(count, std::int64_t{0});
    if (left < 0) {
      body.fail(fmt::format("its faces have more than {} corners", kMostFileCorners));
    }
    for (std::int64_t c = 0; c < count; ++c) {
      corners.push_back(body.next_integer(property.type, "a corner of a face"));
    }
  }
  return corners;
}

constexpr const char* kStrips = "tristrips";

const Element* find_element(const Header& header, std::string_view name) {
  const auto found = std::find_if(header.elements.begin(), header.elements.end(),
                                  [&](const Element& candidate) { return candidate.name == name; });
  return found == header.elements.end() ? nullptr : &*found;
}

/// How many faces or strips an element announces, 0 without it.
std::int64_t corner_lists(const Element* element, const std::string& name) {
  if (element != nullptr && std::none_of(element->properties.begin(), element->properties.end(), is_corner_list)) {
    throw InputError(
        fmt::format("{}: the element '{}' of the PLY file has no list 'vertex_indices'", name, element->name));
  }
  return element == nullptr ? 0 : element->count;
}

void require_elements(const Header& header, const std::string& name) {
  const Element* vertex = find_element(header, "vertex");
  const Element* face = find_element(header, "face");
  const Element* strips = find_element(header, kStrips);
  require(vertex != nullptr && (face != nullptr || strips != nullptr), "{}: the PLY header has no element '{}'", name,
          vertex == nullptr ? "vertex" : "face");
  for (const char* axis : {"x", "y", "z"}) {
    if (std::none_of(vertex->properties.begin(), vertex->properties.end(),
                     [&](const Property& property) { return property.name == axis && !property.count_type; })) {
      throw InputError(fmt::format("{}: the vertices of the PLY file have no property '{}'", name, axis));
    }
  }
  require_few(vertex->count, 0, name);
  for (const Element* element : {face, strips}) {
    require_few(0, corner_lists(element, name), name);
  }
}

}  // namespace

FileSurface parse_ply(const std::string& content, const std::string& name) {
  const Header header = parse_header(content, name);
  require_elements(header, name);
  FileSurface surface;
  std::vector<std::vector<std::int64_t>> polygons;
  std::int64_t corners_left = kMostFileCorners;
  Body body(content, name, header);
  for (const Element& element : header.elements) {
    const bool is_vertex = element.name == "vertex";
    const bool is_face = element.name == "face";
    const bool is_strip = element.name == kStrips;
    // An element without properties takes no bytes, however many entries it has.
    for (std::int64_t i = 0; i < element.count && !element.properties.empty(); ++i) {
      if (is_vertex) {
        surface.points.push_back(parse_vertex(body, element));
      } else if (is_face) {
        polygons.push_back(parse_corners(body, element, corners_left));
      } else if (is_strip) {
        add_strip(polygons, parse_corners(body, element, corners_left));
      } else {
        std::for_each(element.properties.begin(), element.properties.end(),
                      [&](const Property& property) { skip(body, property); });
      }
    }
  }
  if (const std::size_t left = body.left(); left > 0) {
    surface.notes.push_back(bytes_behind_text(left));
  }
  add_polygons(surface, polygons, name);
  return surface;
}

std::string as_ply(const TriangleMesh& mesh, double unit, const FaceNumbers& numbers) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "element face {}\nproperty list uchar int vertex_indices\n",
      mesh.vertex_count(), mesh.face_count());
  for (const auto& [name, values] : numbers) {
    bytes += fmt::format("property float {}\n", name);
  }
  bytes += "end_header\n";
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    append_bytes<double>(bytes, mesh.vertices().col(v) / unit);
  }
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    append_bytes(bytes, std::uint8_t{3});
    for (const int v : mesh.triangles().col(f)) {
      append_bytes(bytes, static_cast<std::int32_t>(v));
    }
    for (const auto& [name, values] : numbers) {
      append_bytes(bytes, static_cast<float>(values(f)));
    }
  }
  return bytes;
}

}  // namespace touchfield
