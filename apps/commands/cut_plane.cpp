#include "apps/commands/cut_plane.h"

#include <cmath>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text_number.h"
#include "sim/scene/number_table.h"

namespace touchfield {

namespace {

[[noreturn]] void refuse(const std::string& text) {
  throw InputError(
      fmt::format("--cut '{}' must be x,y,z,nx,ny,nz or an axis and a place, such as y=-20, y<=-20 or y>=-20, in the "
                  "file's unit. The normal nx,ny,nz must not be 0 and points to the part that is cut off",
                  text));
}

double parse_number(std::string_view word, const std::string& text) {
  const auto value = number_of<double>(word);
  if (!value || !std::isfinite(*value)) {
    refuse(text);
  }
  return *value;
}

CutPlane parse_axis_plane(const std::string& text) {
  const std::size_t axis = std::string_view("xyz").find(text.front());
  std::string_view rest = std::string_view(text).substr(1);
  const double direction = rest.starts_with(">") ? -1.0 : 1.0;
  rest.remove_prefix(rest.starts_with(">=") || rest.starts_with("<=") ? 2 : rest.starts_with("=") ? 1 : 0);
  if (axis == std::string_view::npos || rest.size() + 1 == text.size()) {
    refuse(text);
  }
  const Vector3 along = Vector3::Unit(static_cast<Eigen::Index>(axis));
  return {parse_number(rest, text) * along, direction * along};
}

}  // namespace

CutPlane parse_cut_plane(const std::string& text) {
  if (text.find('=') != std::string::npos) {
    return parse_axis_plane(text);
  }
  std::vector<double> numbers;
  for (const std::string_view word : schema::cells(text)) {
    numbers.push_back(parse_number(word, text));
  }
  if (numbers.size() != 6) {
    refuse(text);
  }
  CutPlane plane{{numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]}};
  if (plane.normal.isZero(0)) {
    refuse(text);
  }
  return plane;
}

}  // namespace touchfield
