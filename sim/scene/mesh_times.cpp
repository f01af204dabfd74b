#include "sim/scene/mesh_times.h"

#include <filesystem>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

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

/// A row of the table; nothing after a report.
std::optional<MeshSeries::Mesh> row(FileReport& report, int line, const MeshSeries& series, std::string_view file,
                                    std::string_view time) {
  const auto seconds = report.number(line, time);
  if (!seconds) {
    return std::nullopt;
  }
  const std::string path = (fs::path(series.folder) / file).lexically_normal().string();
  if (file.empty() || !is_file(path)) {
    report.add(line, fmt::format("file = {} must be that of a mesh in meshes.folder",
                                 file.empty() ? "no value" : quoted_for_message(std::string(file))));
    return std::nullopt;
  }
  if (!series.meshes.empty() && *seconds <= series.meshes.back().seconds) {
    report.add(line, fmt::format("time_s = {:.15g} must be after {:.15g}, that of the file before it", *seconds,
                                 series.meshes.back().seconds));
    return std::nullopt;
  }
  return MeshSeries::Mesh{path, *seconds};
}

}  // namespace

bool read_mesh_times(const Input& in, MeshShape& mesh) {
  MeshSeries& series = *mesh.series;
  if (!is_folder(series.folder)) {
    return in.key("folder").problem(fmt::format("{} must be a folder", series.folder));
  }
  const Input times = in.key("times");
  FileReport report(times, series.times);
  const auto text = report.text();
  if (!text) {
    return false;
  }
  std::optional<std::size_t> time_column;
  for_each_line(*text, [&](int line, std::string_view content) {
    if (trimmed(content).empty() || report.full() || (!time_column && report.failed())) {
      return;
    }
    const auto parts = cells(content);
    if (!time_column) {
      const bool forth = parts.size() == 2 && parts[0] == "file" && parts[1] == "time_s";
      const bool back = parts.size() == 2 && parts[0] == "time_s" && parts[1] == "file";
      if (!forth && !back) {
        report.add(line, "a header file,time_s must come first");
        return;
      }
      time_column = forth ? 1 : 0;
      return;
    }
    if (parts.size() != 2) {
      report.add(line, fmt::format("{} value{}, must be 2", parts.size(), parts.size() == 1 ? "" : "s"));
      return;
    }
    if (auto read = row(report, line, series, parts[1 - *time_column], parts[*time_column])) {
      series.meshes.push_back(std::move(*read));
    }
  });
  report.require_few(series.meshes.size(), "meshes");
  if (!report.failed() && series.meshes.empty()) {
    report.add("no mesh in it, must hold at least one");
  }
  if (report.failed()) {
    return false;
  }
  mesh.file = series.meshes.front().file;
  return true;
}

}  // namespace touchfield::schema
