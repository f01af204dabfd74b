#include "sim/pictures/figures.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/pictures/skin_picture.h"

namespace touchfield {

namespace {

/// The run with the evaluation's skin and pressures for its own, where there are some: what its metrics are of.
Run as_evaluated(Run run) {
  const bool apart = run.evaluation_model && std::ranges::all_of(run.methods, [](const MethodResult& result) {
                       return result.evaluation_pressure.size() != 0 && result.pressure.size() != 0;
                     });
  for (MethodResult& result : run.methods) {
    if (apart) {
      result.pressure = result.evaluation_pressure;
    } else if (run.evaluation_model) {
      result.radiation.resize(0);  // it is of another skin
    }
  }
  if (apart) {
    run.mesh = run.evaluation_model->mesh;
    run.target = run.evaluation_model->target;
  }
  return run;
}

/// A file's name without its ending, and what draws it.
struct NamedPicture {
  std::string name;
  std::function<std::string()> draw;
};

std::vector<NamedPicture> pictures_of(const Run& run) {
  std::vector<NamedPicture> pictures;
  if (run.target || std::ranges::any_of(run.methods, [](const auto& result) { return result.pressure.size() != 0; })) {
    pictures.push_back({"overview", [&run] { return overview_picture(run); }});
  }
  for (const FieldResult& field : run.fields) {
    if (is_plane(field.grid) && !field.pressure.empty()) {
      pictures.push_back({"field_" + field.grid.name, [&run, &field] { return field_picture(run, field); }});
    }
  }
  return pictures;
}

}  // namespace

std::string draw_figure(const std::string& name, const Run& run) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  const std::vector<NamedPicture> pictures = pictures_of(evaluated);
  const auto picture = std::ranges::find(pictures, name, &NamedPicture::name);
  if (picture == pictures.end()) {
    std::vector<std::string> names;
    std::ranges::transform(pictures, std::back_inserter(names), &NamedPicture::name);
    throw InputError(fmt::format("run {}: no picture is called '{}'; the pictures are {}", run.name, name,
                                 names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
  }
  return picture->draw();
}

std::vector<std::string> draw_figures(const std::string& directory, const Run& run) {
  check_run(run);
  const Run evaluated = as_evaluated(run);
  std::vector<std::string> files;
  for (const NamedPicture& picture : pictures_of(evaluated)) {
    files.push_back((std::filesystem::path(directory) / (picture.name + ".png")).string());
    write_atomically(files.back(), {picture.draw()});
  }
  return files;
}

}  // namespace touchfield
