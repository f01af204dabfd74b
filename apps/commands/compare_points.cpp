#include "apps/commands/compare_points.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/standard_streams.h"
#include "sim/assess/calibration_fit.h"
#include "sim/assess/scan_comparison.h"
#include "sim/assess/scan_fit.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/pictures/scan_picture.h"
#include "sim/scene/scene_reader.h"
#include "sim/solve/model.h"
#include "sim/store/run_file.h"

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

/// The points that count.
struct Counting {
  Points at;
  Eigen::VectorXcd computed;
  Eigen::VectorXcd measured;

  explicit Counting(const ScanComparison& comparison) {
    const auto used = static_cast<Eigen::Index>(comparison.used);
    at.resize(3, used);
    computed.resize(used);
    measured.resize(used);
    Eigen::Index i = 0;
    for (const ScanPoint& point : comparison.points) {
      if (point.left_out.empty()) {
        at.col(i) = point.at;
        computed(i) = point.computed;
        measured(i++) = point.measured;
      }
    }
  }
};

void draw(const PointsComparison& asked, const Run& run, const std::string& method, const ScanComparison& comparison) {
  const Counting points(comparison);
  const ScanPicture picture = {.title = fmt::format("{}: {}", run.name, method),
                               .first = fmt::format("{} of {} points, scale {:.4g}", comparison.used,
                                                    comparison.points.size(), comparison.fit.scale),
                               .second = fmt::format("Difference {:.3g} % (L2), correlation {:.4f}",
                                                     100 * comparison.fit.relative, comparison.fit.correlation)};
  if (!asked.picture.empty()) {
    draw_scan(asked.picture, picture, points.computed.cwiseAbs(), points.measured.cwiseAbs(), format_of(asked.picture));
  }
  if (!asked.map.empty()) {
    draw_scan_map(asked.map, picture, points.at, points.computed, points.measured, format_of(asked.map));
  }
}

Json setting_value(const ScanSetting& setting) {
  Json values = Json::object();
  for (int i = 0; i < kScanValues; ++i) {
    values[kScanValueInfo[i].name] = setting(i) / kScanValueInfo[i].unit;
  }
  return values;
}

/// A comparison and how its points were measured.
struct Fitted {
  bool asked = false;
  ScanSetting setting = unchanged_scan();
  ScanFit before;
  ScanComparison comparison;
  std::optional<CalibrationFit> calibration{};
};

Fitted fitted_scan(const Run& run, const std::string& method, const PointsComparison& asked, const std::string& path) {
  const MeasuredPoints measured = read_measured_points(asked.points);
  const Scene scene = read_scene_text(run.scene, path, "");
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  Fitted fitted;
  fitted.asked = !asked.fit.empty() || !asked.fit_from.empty();
  if (!asked.fit_from.empty()) {
    fitted.setting = read_scan_setting(asked.fit_from);
  }
  fitted.comparison = compare_scan(run, wave, method, measured, fitted.setting);
  fitted.before = fitted.comparison.fit;
  if (!asked.fit.empty()) {
    fitted.setting = fit_scan_setting(run, wave, method, measured, fitted.setting, asked.fit);
    fitted.comparison = compare_scan(run, wave, method, measured, fitted.setting);
  }
  if (!asked.calibration.empty()) {
    fitted.calibration = fit_calibration(run, wave, method, measured, fitted.setting);
    write_calibration(asked.calibration, fitted.calibration->response);
  }
  return fitted;
}

Json calibration_value(const CalibrationFit& fit) {
  return {{"channels", fit.error.size()},
          {"dead", fit.dead},
          {"noise", fit.noise},
          {"largest_error", fit.error.maxCoeff()}};
}

}  // namespace

int compare_points(const std::string& run_path, const PointsComparison& asked, const std::optional<double>& tolerance,
                   const CommonFlags& flags) {
  apply_threads(flags);
  const std::string path = run_file_at(run_path);
  const std::vector<std::string> read = {path, asked.points, asked.fit_from};
  std::vector<std::string> outputs;
  for (const std::string& output : {asked.rows, asked.picture, asked.map, asked.fit_out, asked.calibration}) {
    if (!output.empty()) {
      require(std::ranges::find(outputs, output) == outputs.end(),
              "two of --out, --picture, --map, --fit-out and --calibration-out are {}: give different files", output);
      require_free_output(output, asked.force, read);
      outputs.push_back(output);
    }
  }
  for (const std::string& picture : {asked.picture, asked.map}) {
    if (!picture.empty()) {
      format_of(picture);
    }
  }
  const Run run = read_run_file(path, say_warning);
  require(!run.methods.empty(), "{}: no method has finished", path);
  const std::string method = asked.method.empty() ? run.methods.front().name : asked.method;
  const Fitted fitted = fitted_scan(run, method, asked, path);
  const ScanComparison& comparison = fitted.comparison;
  const bool complex = !std::isnan(comparison.fit.turn);
  if (!asked.rows.empty()) {
    write_scan_csv(asked.rows, comparison, complex);
  }
  if (!asked.fit_out.empty()) {
    write_scan_setting(asked.fit_out, fitted.setting);
  }
  draw(asked, run, method, comparison);
  const bool within = !tolerance || comparison.fit.relative <= *tolerance;
  Json value = {{"run", {{"file", path}, {"name", run.name}, {"complete", run.complete}}},
                {"measured", asked.points},
                {"method", method},
                {"tolerance", tolerance ? Json(*tolerance) : Json()},
                {"within_tolerance", tolerance ? Json(within) : Json()}};
  if (fitted.asked) {
    value.update({{"fitted", asked.fit},
                  {"setting", setting_value(fitted.setting)},
                  {"relative_before", fitted.before.relative},
                  {"correlation_before", fitted.before.correlation},
                  {"correlation_about_means_before", fitted.before.about_means}});
  }
  if (fitted.calibration) {
    value["calibration"] = calibration_value(*fitted.calibration);
  }
  value.update(scan_value(comparison, complex));
  value[flags.json ? "points" : "left_out"] = scan_points(comparison, complex, !flags.json);
  print_value(value, flags, true);
  return within ? 0 : 1;
}

}  // namespace touchfield
