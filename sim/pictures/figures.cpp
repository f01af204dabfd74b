#include "sim/pictures/figures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "sim/core/atomic_file.h"
#include "sim/pictures/display.h"
#include "sim/pictures/field_picture.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"
#include "sim/store/run_layout.h"

namespace touchfield {

namespace {

// Without a target colours end here and not at the very largest value, so that a single hot face does not darken all
// the others. With one they end at a multiple of what is wanted, so that a method that presses ten times as hard, as a
// plain focus does, leaves the others their colours.
constexpr double kTopShare = 0.999;
constexpr double kTopOfWanted = 2.0;

std::vector<double> magnitudes(const Eigen::VectorXcd& pressure) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(pressure.size()));
  std::ranges::transform(pressure, std::back_inserter(values), [](const Complex& p) { return std::abs(p); });
  return values;
}

/// The end of the colours for every picture of the skin.
double skin_top(const Run& run) {
  if (run.target) {
    return round_above(kTopOfWanted * *std::ranges::max_element(run.target->amplitudes));
  }
  double top = 0.0;
  for (const MethodResult& result : run.methods) {
    top = std::max(top, quantile(magnitudes(result.pressure), kTopShare));
  }
  return round_above(top);
}

/// The end of the colours for every picture of a plane.
double field_top(const FieldResult& field) {
  double top = 0.0;
  for (const auto& [method, pressure] : field.pressure) {
    std::vector<double> outside;
    for (Eigen::Index i = 0; i < pressure.size(); ++i) {
      if (field.inside[static_cast<std::size_t>(i)] == 0) {
        outside.push_back(std::abs(pressure(i)));
      }
    }
    top = std::max(top, quantile(std::move(outside), kTopShare));
  }
  return round_above(top);
}

/// The metrics that were computed, in words.
std::string metrics_text(const Metrics& metrics) {
  std::string text;
  const auto add = [&](double value, const std::string& words) {
    if (!std::isnan(value)) {
      text += (text.empty() ? "" : "     ") + words;
    }
  };
  add(metrics.relative_error, fmt::format("relative error {:.1f} %", 100.0 * metrics.relative_error));
  const std::string wanted =
      std::isnan(metrics.width_wanted_mm) ? "" : fmt::format(" (wanted {:.1f})", metrics.width_wanted_mm);
  add(metrics.width_mm, fmt::format("width {:.1f} mm{}", metrics.width_mm, wanted));
  add(metrics.leakage, fmt::format("leakage {:.0f} %", 100.0 * metrics.leakage));
  add(metrics.peak_pa, fmt::format("peak {:.0f} Pa", metrics.peak_pa));
  return text;
}

using Picture = std::pair<std::string, std::string>;  // name of the file, PNG

void draw_skin(const Run& run, std::vector<Picture>& pictures) {
  const double top = skin_top(run);
  if (run.target) {
    Eigen::VectorXd wanted = Eigen::VectorXd::Zero(run.mesh.face_count());
    wanted(run.target->faces) = run.target->amplitudes;
    const std::string caption = fmt::format("{} of {} faces, up to {:.6g} Pa", run.target->size(),
                                            run.mesh.face_count(), *std::ranges::max_element(run.target->amplitudes));
    pictures.emplace_back(
        "target.png",
        skin_picture(run, wanted, top, {.title = run.name, .subtitle = "wanted pressure", .caption = caption}));
  }
  for (const MethodResult& result : run.methods) {
    if (result.pressure.size() != 0) {
      pictures.emplace_back(
          fmt::format("pressure_{}.png", result.name),
          skin_picture(
              run, result.pressure.cwiseAbs(), top,
              {.title = run.name, .subtitle = "method " + result.name, .caption = metrics_text(result.metrics)}));
    }
  }
}

void draw_planes(const Run& run, std::vector<Picture>& pictures) {
  for (const FieldResult& field : run.fields) {
    if (!is_plane(field.grid)) {
      continue;
    }
    const double top = field_top(field);
    for (const auto& [method, pressure] : field.pressure) {
      pictures.emplace_back(
          fmt::format("field_{}_{}.png", field.grid.name, method),
          field_picture(run, field, pressure, top, fmt::format("field {}, method {}", field.grid.name, method)));
    }
  }
}

}  // namespace

bool can_draw() { return DisplayConnection().can_draw(); }

std::vector<std::string> draw_figures(const std::string& directory, const Run& run) {
  check_run(run);
  const DisplayConnection display;  // open until the last picture is drawn
  display.require();
  std::vector<Picture> pictures;
  draw_skin(run, pictures);
  draw_planes(run, pictures);
  std::vector<std::string> files;
  for (const auto& [name, png] : pictures) {
    files.push_back((std::filesystem::path(directory) / name).string());
    write_atomically(files.back(), {png});
  }
  return files;
}

}  // namespace touchfield
