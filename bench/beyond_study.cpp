// What edges and keep_within cost the pattern on the whole hand: every line is evaluated with all others of its scene
// on one fine mesh of it. One factor at a time leaves its default. The table is CSV.
//
// usage: beyond_study SCENE [--set key.path=value]... < settings
// settings: a line each of near_mm far_mm kept_mm; kept 0: the whole hand

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "sim/core/progress.h"
#include "sim/field/metrics.h"
#include "sim/model/model.h"
#include "sim/run/methods.h"
#include "sim/run/skin_scattering.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {
namespace {

using Clock = std::chrono::steady_clock;

struct Setting {
  double near = 0;
  double far = 0;
  double kept = 0;
};

struct Line {
  Setting setting;
  Eigen::Index faces = 0;
  double seconds = 0;
};

std::vector<Setting> settings_in(std::istream& in) {
  std::vector<Setting> settings;
  for (std::string text; std::getline(in, text);) {
    std::istringstream words(text);
    Setting s;
    if (words >> s.near >> s.far >> s.kept) {
      settings.push_back(s);
    }
  }
  return settings;
}

void study(const std::string& path, const std::vector<std::string>& changes, const std::vector<Setting>& settings) {
  fmt::print("scene,method,near_mm,far_mm,kept_mm,faces,seconds,relative_error,leakage\n");
  std::vector<Line> lines;
  std::vector<Eigen::VectorXcd> drives;
  KeptBodies kept;
  Progress silent;
  for (const Setting& setting : settings) {
    std::vector<std::string> all = changes;
    all.push_back(fmt::format("body.edge_mm.near_target={}", setting.near));
    all.push_back(fmt::format("body.edge_mm.far={}", setting.far));
    all.push_back(setting.kept > 0 ? fmt::format("body.keep_within_mm={}", setting.kept) : "body.keep_within_mm=null");
    const Model model = build_model(read_scene(path, all), &kept);
    const auto begin = Clock::now();
    std::vector<SolveRecord> records;
    SkinScattering scattering(model.body.mesh, model.fixed->wave, model.fixed->scene.solve.scheme,
                              model.fixed->scene.solve.solver, model.fixed->array, records, silent, 700);
    const Target target = build_target(model);
    MethodSolver methods(scattering, model.fixed->array.size(), target, model.fixed->scene.solve, outside_skin(model));
    for (const MethodSpec& method : model.fixed->scene.solve.methods) {
      drives.push_back(drive(methods.solve(method, target.amplitudes, silent)));
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    lines.push_back({setting, model.body.mesh.face_count(), seconds});
    std::fprintf(stderr, "%s: %.1f s\n", all.back().c_str(), seconds);
  }
  std::vector<std::string> whole = changes;
  whole.emplace_back("body.keep_within_mm=null");
  whole.emplace_back("evaluation={scheme: burton_miller_polished, edge_mm: {near_target: 1.2, far: 3, within_mm: 15}}");
  const Model model = build_model(read_scene(path, whole), &kept);
  const EvaluationMesh evaluation = model.fixed->evaluation.mesh(model, &kept);
  const Target target = build_target(model, evaluation.mesh);
  std::vector<SolveRecord> records;
  SkinScattering scattering(evaluation.mesh, model.fixed->wave, Scheme::kBurtonMillerPolished, {}, model.fixed->array,
                            records, silent, static_cast<Eigen::Index>(drives.size()));
  Eigen::MatrixXcd columns(model.fixed->array.size(), static_cast<Eigen::Index>(drives.size()));
  for (std::size_t i = 0; i < drives.size(); ++i) {
    columns.col(static_cast<Eigen::Index>(i)) = drives[i];
  }
  const Eigen::MatrixXcd pressures = scattering.pressure(columns, "evaluation");
  Eigen::Index column = 0;
  for (const Line& line : lines) {
    for (const MethodSpec& method : model.fixed->scene.solve.methods) {
      const Metrics metrics = pattern_metrics(evaluation.mesh, model.boxes, target, pressures.col(column++));
      const Setting& s = line.setting;
      fmt::print("{},{},{:g},{:g},{:g},{},{:.2f},{:.5f},{:.5f}\n", model.fixed->scene.name, method.name, s.near, s.far,
                 s.kept, line.faces, line.seconds, metrics.relative_error, metrics.leakage);
    }
  }
}

}  // namespace
}  // namespace touchfield

int main(int count, char** arguments) {
  if (count < 2 || count % 2 != 0) {
    std::fprintf(stderr, "usage: beyond_study SCENE [--set key.path=value]... < settings\n");
    return 2;
  }
  std::vector<std::string> changes;
  for (int i = 3; i < count; i += 2) {
    changes.emplace_back(arguments[i]);
  }
  try {
    touchfield::study(arguments[1], changes, touchfield::settings_in(std::cin));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "beyond_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
