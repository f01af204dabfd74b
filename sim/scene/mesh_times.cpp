#include "sim/scene/mesh_times.h"

#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/scene/number_table.h"

namespace touchfield::schema {

namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

/// A row of the table.
/// throws   InputError without the place
MeshSeries::Mesh mesh_of(const MeshSeries& series, std::string_view file, std::string_view time) {
  const auto seconds = parse_decimal(time);
  const auto rule = seconds ? Range{}.broken_by(*seconds) : std::optional<std::string>("a number, such as 1.5");
  if (rule) {
    throw InputError(fmt::format("time_s = {} must be {}", quoted_for_message(std::string(time)), *rule));
  }
  const std::string path = (fs::path(series.folder) / file).lexically_normal().string();
  require(!file.empty() && is_file(path), "file = {} must be that of a mesh in meshes.folder",
          file.empty() ? "no value" : quoted_for_message(std::string(file)));
  const double before = series.meshes.empty() ? -Range::kLargest : series.meshes.back().seconds;
  require(series.meshes.empty() || *seconds > before,
          "time_s = {:.15g} must be after {:.15g}, that of the row before it", *seconds, before);
  return {path, *seconds};
}

}  // namespace

bool read_mesh_times(const Input& in, MeshShape& mesh) {
  MeshSeries& series = *mesh.series;
  if (!is_folder(series.folder)) {
    return in.key("folder").problem(fmt::format("{} must be a folder", series.folder));
  }
  const auto read = read_named(in.key("times"), [&] {
    std::size_t time = 0;
    read_table(
        series.times, kMostTextBytes,
        [&](const Cells& names) {
          time = names.front() == "time_s" ? 0 : 1;
          require(names.size() == 2 && names[time] == "time_s" && names[1 - time] == "file",
                  "a header file,time_s must come first");
        },
        [&](int, const Cells& row) {
          series.meshes.push_back(mesh_of(series, row[1 - time], row[time]));
          require(series.meshes.size() <= kMostListed, "too many meshes, must be at most {}", kMostListed);
        });
    require(!series.meshes.empty(), "{}: no mesh in it, must hold at least one", series.times);
    return series.meshes.front().file;
  });
  mesh.file = read.value_or("");
  return read.has_value();
}

}  // namespace touchfield::schema
