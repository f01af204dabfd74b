#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/pictures/figures.h"
#include "sim/run/run_text.h"
#include "sim/run/text_table.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

std::string caption_of(const Metrics& metrics) {
  std::string text;
  const auto add = [&](double value, const std::string& words) {
    if (!std::isnan(value)) {
      text += (text.empty() ? "" : ", ") + words;
    }
  };
  add(metrics.relative_error_radiation, fmt::format("error of P {:.1f} %", 100.0 * metrics.relative_error_radiation));
  add(metrics.width_radiation_mm, fmt::format("width {:.1f} mm", metrics.width_radiation_mm));
  add(metrics.force_target_n, fmt::format("{:.3g} mN", 1e3 * metrics.force_target_n));
  return text;
}

}  // namespace

ViewData run_view(const Run& run) {
  Run evaluated = as_evaluated(run);
  ViewSkin skin{.mesh = std::move(evaluated.mesh), .target = std::move(evaluated.target)};
  ViewData data{.title = run.name,
                .methods = {},
                .array = run.array,
                .radiation_per_square = run.radiation_per_square,
                .skins = {},
                .fields = std::move(evaluated.fields)};
  for (MethodResult& result : evaluated.methods) {
    data.methods.push_back({result.name, caption_of(result.metrics)});
    skin.pressure.push_back(std::move(result.pressure));
    skin.radiation.push_back(std::move(result.radiation));
  }
  data.skins.push_back(std::move(skin));
  return data;
}

std::string run_page(const Run& run, const std::string& overview) {
  return view_page(run_view(run), overview, run_report(run));
}

std::string run_page(const Run& run) { return run_page(run, has_overview(run) ? draw_figure("overview", run) : ""); }

}  // namespace touchfield
