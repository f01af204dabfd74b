#include "sim/mesh/io/isolated_surface.h"

#include <cstring>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

/// What the other process has sent, number by number.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  template <class T>
  std::vector<T> take(std::int64_t count) {
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() / sizeof(T)) {
      throw InputError(fmt::format("{}: is damaged: it is cut short", name_));
    }
    std::vector<T> values(static_cast<std::size_t>(count));
    if (!values.empty()) {
      std::memcpy(values.data(), bytes_.data(), values.size() * sizeof(T));
    }
    bytes_.remove_prefix(values.size() * sizeof(T));
    return values;
  }
  std::int64_t number() { return take<std::int64_t>(1).front(); }

 private:
  std::string_view bytes_;
  const std::string& name_;
};

}  // namespace

FileSurface isolated_surface(const std::string& content, const std::string& name,
                             const std::function<void(const Emit&)>& send) {
  constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;
  const WorkLimits limits{.memory = 512 * kMebibyte + 8 * content.size(),
                          .output = sizeof(double) * (3 * kMostFilePoints + 2 * kMostFileFaces + kMostFileCorners),
                          .seconds = 10 + static_cast<int>(content.size() / (20 * kMebibyte))};
  const WorkOutput found = isolated(name + ": is damaged: reading it", limits, send);
  Reader reader(found.bytes, name);
  FileSurface surface;
  const std::int64_t points = reader.number();
  require_few(points, 0, name);
  const std::vector<double> values = reader.take<double>(3 * points);
  for (std::size_t i = 0; i < values.size(); i += 3) {
    const Vector3 point(values[i], values[i + 1], values[i + 2]);
    if (!point.allFinite()) {
      throw InputError(fmt::format("{}: point {} has a coordinate that is not a finite number ({}, {}, {})", name,
                                   i / 3, point.x(), point.y(), point.z()));
    }
    surface.points.push_back(point);
  }
  std::vector<std::vector<std::int64_t>> polygons;
  const auto for_each_cell = [&](const auto& add) {
    const std::int64_t cells = reader.number();
    require_few(0, cells, name);
    for (std::int64_t cell = 0; cell < cells; ++cell) {
      add(reader.take<std::int64_t>(reader.number()));
    }
  };
  for_each_cell([&](std::vector<std::int64_t> corners) { polygons.push_back(std::move(corners)); });
  for_each_cell([&](const std::vector<std::int64_t>& corners) { add_strip(polygons, corners); });
  add_polygons(surface, polygons, name);
  return surface;
}

}  // namespace touchfield
