#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/compare_points.h"
#include "apps/commands/run_json.h"
#include "apps/commands/standard_streams.h"
#include "sim/batch/scene_changes.h"
#include "sim/core/json_text.h"
#include "sim/core/require.h"
#include "sim/core/utf8.h"
#include "sim/store/run_compare.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

using Json = nlohmann::ordered_json;

Json text_or_null(const std::optional<std::string>& text) { return text ? Json(*text) : Json(nullptr); }

Json number_or_null(const std::optional<double>& value) {
  return value ? touchfield::number_or_null(*value) : Json(nullptr);
}

Json changes_json(const std::vector<TextChange>& changes) {
  Json json = Json::object();
  for (const TextChange& change : changes) {
    json[change.what] = {{"a", text_or_null(change.a)}, {"b", text_or_null(change.b)}};
  }
  return json;
}

template <class Pair>
Json pair_json(const Pair& pair) {
  return {{"a", pair.first}, {"b", pair.second}};
}

Json only_json(const OnlyIn& only) { return {{"a", only.a}, {"b", only.b}}; }

Json deviation_json(const Deviation& deviation) {
  return {{"relative", number_or_null(deviation.relative)}, {"what", deviation.what}};
}

Json numbers_json(const NumbersDifference& difference) {
  return {{"identical", difference.identical},
          {"relative", number_or_null(difference.relative)},
          {"fault", difference.fault}};
}

Json complex_json(const ComplexDifference& difference) {
  return {{"identical", difference.identical},
          {"relative", number_or_null(difference.relative)},
          {"as_it_is", number_or_null(difference.as_is)},
          {"turn_rad", difference.turn},
          {"fault", difference.fault}};
}

Json phases_json(const PhasesDifference& difference) {
  return {{"identical", difference.identical},
          {"largest_rad", number_or_null(difference.largest)},
          {"rms_rad", number_or_null(difference.rms)},
          {"turn_rad", difference.turn},
          {"fault", difference.fault}};
}

Json mesh_json(const MeshDifference& mesh) {
  Json json = {{"identical", mesh.identical},
               {"faces", pair_json(mesh.faces)},
               {"vertices", pair_json(mesh.vertices)},
               {"same_triangles", mesh.same_triangles},
               {"largest_distance_m", number_or_null(mesh.distance)},
               {"relative", number_or_null(mesh.relative)},
               {"motion", nullptr}};
  if (mesh.motion) {
    const Vector3& shift = mesh.motion->shift;
    json["motion"] = {{"shift_m", {shift.x(), shift.y(), shift.z()}},
                      {"angle_rad", mesh.motion->angle},
                      {"residual_m", mesh.motion->residual}};
  }
  return json;
}

Json array_json(const ArrayDifference& array) {
  return {{"identical", array.identical},
          {"channels", pair_json(array.channels)},
          {"changes", changes_json(array.texts)},
          {"same_numbering", array.same_numbering},
          {"largest_distance_m", number_or_null(array.distance)},
          {"largest_tilt_rad", number_or_null(array.tilt)},
          {"amplitudes", numbers_json(array.amplitudes)},
          {"responses", numbers_json(array.responses)},
          {"true_responses", numbers_json(array.true_responses)},
          {"relative", number_or_null(array.relative)}};
}

Json target_json(const TargetDifference& target) {
  return {{"identical", target.identical},
          {"faces", pair_json(target.faces)},
          {"faces_in_one_alone", pair_json(target.only_faces)},
          {"amplitudes", numbers_json(target.amplitudes)},
          {"relative", number_or_null(target.relative)}};
}

Json judge_json(const JudgeDifference& judge) {
  Json json = {{"changes", changes_json(judge.texts)}, {"mesh", nullptr}, {"target", nullptr}};
  if (judge.mesh) {
    json["mesh"] = mesh_json(*judge.mesh);
    json["target"] = target_json(*judge.target);
  }
  return json;
}

Json number_pairs_json(const std::vector<NumberPair>& pairs, bool with_relative) {
  Json json = Json::object();
  for (const NumberPair& pair : pairs) {
    Json entry = {{"a", number_or_null(pair.a)}, {"b", number_or_null(pair.b)}};
    if (with_relative) {
      entry["relative"] = number_or_null(pair.relative);
    }
    json[pair.name] = std::move(entry);
  }
  return json;
}

Json method_json(const MethodDifference& method) {
  Json cost = numbers_json(method.cost);
  cost["length"] = pair_json(method.cost_length);
  return {{"name", method.name},
          {"identical", method.identical},
          {"changes", changes_json(method.texts)},
          {"phases", phases_json(method.phases)},
          {"amplitudes", numbers_json(method.amplitudes)},
          {"pressure", complex_json(method.pressure)},
          {"judge_pressure", method.judge_pressure ? complex_json(*method.judge_pressure) : Json(nullptr)},
          {"cost", std::move(cost)},
          {"metrics", number_pairs_json(method.metrics, true)},
          {"seconds", number_pairs_json(method.seconds, false)}};
}

Json field_json(const FieldDifference& field) {
  Json pressure = Json::object();
  for (const auto& [method, difference] : field.pressure) {
    pressure[method] = complex_json(difference);
  }
  return {{"name", field.name},
          {"identical", field.identical},
          {"fault", field.fault},
          {"inside_in_one_alone", field.inside},
          {"pressure", std::move(pressure)}};
}

template <class List, class Convert>
Json list_json(const List& list, const Convert& convert) {
  Json json = Json::array();
  std::ranges::transform(list, std::back_inserter(json), convert);
  return json;
}

/// What is infinitely far apart is null; `fault` says why.
Json difference_json(const RunDifference& difference) {
  return {{"verdict", to_string(difference.verdict)},
          {"rounding", difference.rounding},
          {"largest", deviation_json(difference.largest)},
          {"largest_result", deviation_json(difference.largest_result)},
          {"causes", difference.causes},
          {"judged_skin",
           {{"a", to_string(difference.judged_skin.first)}, {"b", to_string(difference.judged_skin.second)}}},
          {"provenance", changes_json(difference.provenance)},
          {"scene", changes_json(difference.scene.changes)},
          {"scene_defaults_in_one_alone", only_json(difference.scene.at_defaults)},
          {"mesh", mesh_json(difference.mesh)},
          {"array", array_json(difference.array)},
          {"target", target_json(difference.target)},
          {"judge", judge_json(difference.judge)},
          {"solvers", changes_json(difference.solvers)},
          {"warnings_in_one_alone", only_json(difference.warnings)},
          {"notes_in_one_alone", only_json(difference.notes)},
          {"methods_in_one_alone", only_json(difference.methods)},
          {"fields_in_one_alone", only_json(difference.fields)},
          {"methods", list_json(difference.both_methods, method_json)},
          {"fields", list_json(difference.both_fields, field_json)}};
}

struct CompareCommand {
  std::string a;  // run.h5, or the directory that holds one
  std::string b;
  PointsComparison points;          // instead of b
  std::optional<double> tolerance;  // relative
};

std::string heading(char letter, const std::string& path, const Run& run) {
  return fmt::format("{:<9} {}: {}, {}\n", letter, path, one_line(run.name),
                     run.complete ? "complete" : "NOT COMPLETE");
}

std::string tolerance_line(double tolerance, const Deviation& largest) {
  if (largest.relative <= tolerance) {
    return fmt::format("{:<9} {:g}: every result is within it\n", "tolerance", tolerance);
  }
  const std::string far = std::isfinite(largest.relative) ? fmt::format(" differs by {:.2g}", largest.relative) : "";
  return fmt::format("{:<9} {:g}: EXCEEDED: {}{}\n", "tolerance", tolerance, largest.what, far);
}

int compare_command(const CompareCommand& command, const CommonFlags& flags) {
  if (!command.points.points.empty()) {
    return compare_points(command.a, command.points, command.tolerance, flags);
  }
  require(!command.b.empty(), "compare: B is missing: give another run, or --points FILE");
  const std::string path_a = run_file_at(command.a);
  const std::string path_b = run_file_at(command.b);
  const Run a = read_run_file(path_a);
  const Run b = read_run_file(path_b);
  const RunDifference difference = compare_runs(a, b, scene_changes(a.scene, b.scene));
  const bool within = !command.tolerance || difference.largest_result.relative <= *command.tolerance;
  if (flags.json) {
    Json json = {{"a", {{"file", path_a}, {"name", a.name}, {"complete", a.complete}}},
                 {"b", {{"file", path_b}, {"name", b.name}, {"complete", b.complete}}}};
    json["tolerance"] = command.tolerance ? Json(*command.tolerance) : nullptr;
    json["within_tolerance"] = command.tolerance ? Json(within) : nullptr;
    json.update(difference_json(difference));
    put(json_text(json, 2) + "\n");
  } else {
    put(fmt::format("{}{}{}", heading('A', path_a, a), heading('B', path_b, b), describe_difference(difference)));
    if (command.tolerance) {
      put(tolerance_line(*command.tolerance, difference.largest_result));
    }
  }
  return within ? 0 : 1;
}

}  // namespace

void add_compare_command(CLI::App& app, Invocation& invocation) {
  const auto compare = std::make_shared<CompareCommand>();
  CLI::App* command = app.add_subcommand("compare", "Compare two runs, or a run with a measured field");
  command->add_option("A", compare->a, "run.h5, or the directory that holds it")->required()->type_name(kH5File);
  CLI::Option* other = command->add_option("B", compare->b, "The other run")->type_name(kH5File);
  PointsComparison& points = compare->points;
  CLI::Option* file =
      command
          ->add_option(
              "--points", points.points,
              "Compare the field with measured points instead: a table with x_mm,y_mm,z_mm and p_pa, or p_re,p_im")
          ->excludes(other)
          ->type_name(kAnyFile);
  command->add_option("--method", points.method, "Method of the field; default: the run's first")->needs(file);
  command->add_option("--out", points.rows, "Write a CSV file with one row per point")
      ->needs(file)
      ->type_name(kAnyFile);
  command->add_option("--picture", points.picture, "Draw measured against computed values: a .png, .pdf or .svg file")
      ->needs(file)
      ->type_name(kAnyFile);
  command->add_flag("--force", points.force, "Replace these files")->needs(file);
  add_number(command, "--tolerance", compare->tolerance, schema::at_least(0),
             "Exit code 1 if a result, or the field at measured points, differs by more than this relative amount");
  finish_command(command, invocation,
                 [compare](const Invocation& invoked) { return compare_command(*compare, invoked.flags); });
}

}  // namespace touchfield
