#include "apps/commands/compare_points.h"

#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/model/model.h"
#include "sim/pictures/plots.h"
#include "sim/run/run_file.h"
#include "sim/run/scan_comparison.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

PictureFormat format_of(const std::string& picture) {
  const std::string ending = std::filesystem::path(picture).extension().string();
  for (const PictureFormat format : {PictureFormat::kPng, PictureFormat::kPdf, PictureFormat::kSvg}) {
    if (ending == "." + to_string(format)) {
      return format;
    }
  }
  throw InputError(fmt::format("{}: the name of a picture must end in .png, .pdf or .svg", picture));
}

void draw(const PointsComparison& asked, const Run& run, const std::string& method, const ScanComparison& comparison) {
  Eigen::VectorXd computed(static_cast<Eigen::Index>(comparison.used));
  Eigen::VectorXd measured(computed.size());
  Eigen::Index i = 0;
  for (const ScanPoint& point : comparison.points) {
    if (point.left_out.empty()) {
      computed(i) = std::abs(point.computed);
      measured(i++) = std::abs(point.measured);
    }
  }
  const ScanPicture picture = {.title = fmt::format("{}: {}", run.name, method),
                               .first = fmt::format("{} of {} points, scale {:.4g}", comparison.used,
                                                    comparison.points.size(), comparison.fit.scale),
                               .second = fmt::format("Difference {:.3g} % (L2), correlation {:.4f}",
                                                     100 * comparison.fit.relative, comparison.fit.correlation)};
  draw_scan(asked.picture, picture, computed, measured, format_of(asked.picture));
}

}  // namespace

int compare_points(const std::string& run_path, const PointsComparison& asked, const std::optional<double>& tolerance,
                   const CommonFlags& flags) {
  apply_threads(flags);
  const std::string path = run_file_at(run_path);
  require(asked.rows.empty() || asked.rows != asked.picture, "--out and --picture are both {}: give different files",
          asked.rows);
  for (const std::string& output : {asked.rows, asked.picture}) {
    if (!output.empty()) {
      require_free_output(output, asked.force, {path, asked.points});
    }
  }
  if (!asked.picture.empty()) {
    format_of(asked.picture);
  }
  const Run run = read_run_file(path, say_warning);
  require(!run.methods.empty(), "{}: no method has finished", path);
  const std::string method = asked.method.empty() ? run.methods.front().name : asked.method;
  const MeasuredPoints measured = read_measured_points(asked.points);
  const Scene scene = read_scene_text(run.scene, path, "");
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  const ScanComparison comparison = compare_scan(run, wave, method, measured);
  const bool complex = !std::isnan(comparison.fit.turn);
  if (!asked.rows.empty()) {
    write_scan_csv(asked.rows, comparison, complex);
  }
  if (!asked.picture.empty()) {
    draw(asked, run, method, comparison);
  }
  const bool within = !tolerance || comparison.fit.relative <= *tolerance;
  Json value = {{"run", {{"file", path}, {"name", run.name}, {"complete", run.complete}}},
                {"measured", asked.points},
                {"method", method},
                {"tolerance", tolerance ? Json(*tolerance) : Json()},
                {"within_tolerance", tolerance ? Json(within) : Json()}};
  value.update(scan_value(comparison, complex));
  value[flags.json ? "points" : "left_out"] = scan_points(comparison, complex, !flags.json);
  print_value(value, flags, true);
  return within ? 0 : 1;
}

}  // namespace touchfield
