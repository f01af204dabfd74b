#include "apps/commands/compare_points.h"

#include <filesystem>

#include <fmt/format.h>

#include "apps/commands/run_json.h"
#include "apps/commands/standard_streams.h"
#include "sim/assess/scan_comparison.h"
#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/pictures/scan_picture.h"
#include "sim/scene/scene_reader.h"
#include "sim/solve/model.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

using Json = nlohmann::ordered_json;

PictureFormat format_of(const std::string& picture) {
  const std::string ending = std::filesystem::path(picture).extension().string();
  for (const PictureFormat format : {PictureFormat::kPng, PictureFormat::kPdf, PictureFormat::kSvg}) {
    if (ending == "." + to_string(format)) {
      return format;
    }
  }
  throw InputError(fmt::format("{}: the name of a picture must end in .png, .pdf or .svg", picture));
}

Json scan_json(const ScanComparison& comparison, bool complex) {
  const auto value = [&](const Complex& p) {
    return complex ? Json::array({number_or_null(p.real()), number_or_null(p.imag())}) : number_or_null(p.real());
  };
  Json rows = Json::array();
  for (const ScanPoint& point : comparison.points) {
    const bool counts = point.left_out.empty();
    rows.push_back({{"line", point.line},
                    {"at_mm", {point.at.x() / kMillimetre, point.at.y() / kMillimetre, point.at.z() / kMillimetre}},
                    {"measured", value(point.measured)},
                    {"computed", counts ? value(point.computed) : Json(nullptr)},
                    {"difference", counts ? number_or_null(point.difference) : Json(nullptr)},
                    {"left_out", point.left_out}});
  }
  return {{"complex", complex},
          {"used", comparison.used},
          {"scale", comparison.fit.scale},
          {"turn_rad", number_or_null(comparison.fit.turn)},
          {"relative", comparison.fit.relative},
          {"largest_relative", comparison.largest_relative},
          {"largest_line", comparison.points[comparison.largest].line},
          {"correlation", comparison.fit.correlation},
          {"conjugate_correlation", number_or_null(comparison.conjugate_correlation)},
          {"points", std::move(rows)}};
}

void draw(const std::string& picture, const Run& run, const std::string& method, const ScanComparison& comparison) {
  Eigen::VectorXd computed(static_cast<Eigen::Index>(comparison.used));
  Eigen::VectorXd measured(computed.size());
  Eigen::Index i = 0;
  for (const ScanPoint& point : comparison.points) {
    if (point.left_out.empty()) {
      computed(i) = std::abs(point.computed);
      measured(i++) = std::abs(point.measured);
    }
  }
  draw_scan(
      picture, fmt::format("{}: {}", run.name, method), computed, measured,
      fmt::format("{} of {} points, scale {:.4g}", comparison.used, comparison.points.size(), comparison.fit.scale),
      fmt::format("Difference {:.3g} % (L2), correlation {:.4f}", 100 * comparison.fit.relative,
                  comparison.fit.correlation),
      format_of(picture));
}

}  // namespace

int compare_points(const std::string& run_path, const PointsComparison& asked, const std::optional<double>& tolerance,
                   const CommonFlags& flags) {
  apply_threads(flags);
  const std::string path = run_file_at(run_path);
  if (!asked.rows.empty() && asked.rows == asked.picture) {
    throw InputError(fmt::format("--out and --picture are both {}: give two files", asked.rows));
  }
  for (const std::string& output : {asked.rows, asked.picture}) {
    if (!output.empty()) {
      require_free_output(output, asked.force, {path, asked.points});
    }
  }
  if (!asked.picture.empty()) {
    format_of(asked.picture);
  }
  const Run run = read_run_file(path);
  require(!run.methods.empty(), "{}: no method has finished", path);
  const std::string method = asked.method.empty() ? run.methods.front().name : asked.method;
  const MeasuredPoints measured = read_measured_points(asked.points);
  const Scene scene = read_scene_text(run.scene, path, "");
  const Wave wave(build_medium(scene.medium, scene.frequency), scene.frequency);
  const ScanComparison comparison = compare_scan(run, wave, method, measured);
  if (!asked.rows.empty()) {
    write_scan_csv(asked.rows, comparison, measured.complex);
  }
  if (!asked.picture.empty()) {
    draw(asked.picture, run, method, comparison);
  }
  const bool within = !tolerance || comparison.fit.relative <= *tolerance;
  if (flags.json) {
    Json json = {{"run", {{"file", path}, {"name", run.name}, {"complete", run.complete}}},
                 {"measured", asked.points},
                 {"method", method}};
    json["tolerance"] = tolerance ? Json(*tolerance) : nullptr;
    json["within_tolerance"] = tolerance ? Json(within) : nullptr;
    json.update(scan_json(comparison, measured.complex));
    put(json_text(json, 2) + "\n");
    return within ? 0 : 1;
  }
  put(fmt::format("{:<12} {}: {}, method {}\n{:<12} {}\n{}", "run", path, run.name, method, "measured", asked.points,
                  describe_scan(comparison, measured.complex)));
  if (tolerance) {
    put(fmt::format("{:<12} {:g}: {}\n", "tolerance", *tolerance, within ? "the difference is within it" : "EXCEEDED"));
  }
  return within ? 0 : 1;
}

}  // namespace touchfield
