#include "apps/commands/compare_json.h"

#include "apps/commands/run_json.h"

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

}  // namespace

nlohmann::ordered_json difference_json(const RunDifference& difference) {
  Json methods = Json::array();
  for (const MethodDifference& method : difference.both_methods) {
    methods.push_back(method_json(method));
  }
  Json fields = Json::array();
  for (const FieldDifference& field : difference.both_fields) {
    fields.push_back(field_json(field));
  }
  return {{"verdict", to_string(difference.verdict)},
          {"rounding", difference.rounding},
          {"largest", deviation_json(difference.largest)},
          {"largest_result", deviation_json(difference.largest_result)},
          {"causes", difference.causes},
          {"provenance", changes_json(difference.provenance)},
          {"scene", changes_json(difference.scene)},
          {"mesh", mesh_json(difference.mesh)},
          {"array", array_json(difference.array)},
          {"target", target_json(difference.target)},
          {"judge", judge_json(difference.judge)},
          {"solvers", changes_json(difference.solvers)},
          {"warnings_in_one_alone", only_json(difference.warnings)},
          {"methods_in_one_alone", only_json(difference.methods)},
          {"fields_in_one_alone", only_json(difference.fields)},
          {"methods", std::move(methods)},
          {"fields", std::move(fields)}};
}

}  // namespace touchfield
