#include "sim/pictures/figures.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/pictures/field_picture.h"
#include "sim/pictures/overview_picture.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/setup_picture.h"
#include "sim/pictures/skin_picture.h"
#include "sim/run/run_layout.h"

namespace touchfield {

namespace {

/// The run with the evaluation's skin and pressures for its own, where there are some: what its metrics are of.
Run as_evaluated(const Run& run) {
  Run evaluated = run;
  const auto is_evaluated = [](const MethodResult& result) {
    return result.evaluation_pressure.size() != 0 && result.pressure.size() != 0;
  };
  if (run.evaluation_model && std::ranges::all_of(run.methods, is_evaluated)) {
    evaluated.mesh = run.evaluation_model->mesh;
    evaluated.target = run.evaluation_model->target;
    for (MethodResult& result : evaluated.methods) {
      result.pressure = result.evaluation_pressure;
    }
  }
  return evaluated;
}

/// The end of the colours for every picture of the skin.
double top_of(const Run& run) {
  std::vector<const Eigen::VectorXcd*> pressures;
  for (const MethodResult& result : run.methods) {
    pressures.push_back(&result.pressure);
  }
  return skin_top(run.target ? run.target->amplitudes.maxCoeff() : 0.0, pressures);
}

/// The end of the colours of a plane.
double field_top(const FieldResult& field, const Eigen::VectorXcd& pressure) {
  std::vector<double> outside;
  for (Eigen::Index i = 0; i < pressure.size(); ++i) {
    if (field.inside[static_cast<std::size_t>(i)] == 0) {
      outside.push_back(std::abs(pressure(i)));
    }
  }
  return round_above(quantile(std::move(outside), kTopShare));
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
  add(metrics.peak_pa, fmt::format("peak {:.3g} kPa", 1e-3 * metrics.peak_pa));
  return text;
}

/// A file's name without its ending, and what draws it.
struct Picture {
  std::string name;
  std::function<std::string()> draw;
};

void add_skin(const Run& run, const SkinPictures& skin, PictureFormat format, std::vector<Picture>& pictures) {
  const double top = top_of(run);
  pictures.push_back({"overview", [&run, top, format] { return overview_picture(run, top, format); }});
  const auto add = [&](const std::string& name, const Eigen::VectorXd& values, const std::string& subtitle,
                       const std::string& caption) {
    const SkinText text = {.title = run.name, .subtitle = subtitle, .caption = caption};
    pictures.push_back({name, [&skin, values, top, text] { return skin.picture(values, top, text); }});
  };
  if (run.target) {
    add("target", wanted_pressure(*run.target, run.mesh.face_count()), "wanted pressure",
        fmt::format("{} of {} faces, up to {:.4g} kPa", run.target->size(), run.mesh.face_count(),
                    1e-3 * *std::ranges::max_element(run.target->amplitudes)));
  }
  for (const MethodResult& result : run.methods) {
    if (result.pressure.size() != 0) {
      add("pressure_" + result.name, result.pressure.cwiseAbs(), "method " + result.name, metrics_text(result.metrics));
    }
  }
}

void add_planes(const Run& run, PictureFormat format, std::vector<Picture>& pictures) {
  for (const FieldResult& field : run.fields) {
    if (!is_plane(field.grid)) {
      continue;
    }
    double loudest = 0.0;
    for (const auto& [method, pressure] : field.pressure) {
      loudest = std::max(loudest, field_top(field, pressure));
    }
    for (const auto& [method, pressure] : field.pressure) {
      pictures.push_back(
          {fmt::format("field_{}_{}", field.grid.name, method),
           [&run, &field, &pressure = pressure, loudest, format,
            subtitle = fmt::format("field {}, method {}", field.grid.name, method)] {
             return field_picture(run, field, pressure, {field_top(field, pressure), loudest}, subtitle, format);
           }});
    }
  }
}

bool has_skin(const Run& run) {
  return run.target ||
         std::ranges::any_of(run.methods, [](const MethodResult& result) { return result.pressure.size() != 0; });
}

/// skin   is made where there is one to draw; outlives the pictures
std::vector<Picture> pictures_of(const Run& run, PictureFormat format, std::optional<SkinPictures>& skin) {
  std::vector<Picture> pictures;
  if (has_skin(run)) {
    if (run.array.kind == TransducerArray::Kind::kTransducers) {
      pictures.push_back({"setup", [&run, format] { return setup_picture(run, format); }});
    }
    skin.emplace(run, format);
    add_skin(run, *skin, format, pictures);
  }
  add_planes(run, format, pictures);
  return pictures;
}

std::vector<std::string> drawn_at_once(const std::vector<Picture>& pictures) {
  std::vector<std::string> files(pictures.size());
  std::exception_ptr failure;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    try {
      files[i] = pictures[i].draw();
    } catch (...) {
#pragma omp critical
      failure = std::current_exception();
    }
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
  return files;
}

}  // namespace

std::string draw_figure(const std::string& name, const Run& run, PictureFormat format) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::optional<SkinPictures> skin;
  const std::vector<Picture> pictures = pictures_of(evaluated, format, skin);
  const auto picture = std::ranges::find(pictures, name, &Picture::name);
  if (picture == pictures.end()) {
    std::vector<std::string> names;
    std::ranges::transform(pictures, std::back_inserter(names), &Picture::name);
    throw InputError(fmt::format("run {}: no picture is called '{}'; the pictures are {}", run.name, name,
                                 names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  return picture->draw();
}

std::vector<std::string> draw_figures(const std::string& directory, const Run& run, PictureFormat format) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::optional<SkinPictures> skin;
  const std::vector<Picture> pictures = pictures_of(evaluated, format, skin);
  const std::vector<std::string> drawn = drawn_at_once(pictures);
  std::vector<std::string> files;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    files.push_back(
        (std::filesystem::path(directory) / fmt::format("{}.{}", pictures[i].name, to_string(format))).string());
    write_atomically(files.back(), {drawn[i]});
  }
  return files;
}

}  // namespace touchfield
