#include "sim/run/run_compare.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string_view>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/run/run_text.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

constexpr double kRounding = 1e-6;
constexpr double kSingleRounding = 1e-4;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

bool same_value(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || (std::isnan(a) && std::isnan(b));
}
bool same_value(const Complex& a, const Complex& b) {
  return same_value(a.real(), b.real()) && same_value(a.imag(), b.imag());
}

bool is_finite(double value) { return std::isfinite(value); }
bool is_finite(const Complex& value) { return std::isfinite(value.real()) && std::isfinite(value.imag()); }

/// 0 of nothing is 0: two silent runs are alike.
double part_of(double part, double whole) { return part == 0.0 ? 0.0 : part / whole; }

Difference incomparable(const std::string& fault) { return {false, kInfinite, fault, kInfinite, 0}; }

/// What can be said of two lists before anything is subtracted: their sizes, which values are the same.
template <class List>
Difference paired(const List& a, const List& b) {
  if (a.size() != b.size()) {
    return incomparable(fmt::format("{} and {} values", a.size(), b.size()));
  }
  Difference pairing;
  std::size_t lost = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.size()); ++i) {
    if (!same_value(a.data()[i], b.data()[i])) {
      pairing.identical = false;
      lost += is_finite(a.data()[i]) && is_finite(b.data()[i]) ? 0 : 1;
    }
  }
  return lost == 0 ? pairing
                   : incomparable(fmt::format("{} of {} values are not finite in one of them", lost, a.size()));
}

/// The same of the entries of two matrices, column by column.
template <class Values>
Difference compare_entries(const Values& a, const Values& b) {
  return compare_numbers({a.data(), static_cast<std::size_t>(a.size())},
                         {b.data(), static_cast<std::size_t>(b.size())});
}

/// What several parts come to.
Difference worst_of(const std::vector<Difference>& parts) {
  Difference worst = *std::ranges::max_element(parts, {}, &Difference::relative);
  worst.identical = std::ranges::all_of(parts, &Difference::identical);
  return worst;
}

Difference compare_meshes(const TriangleMesh& a, const TriangleMesh& b) {
  if (a.face_count() != b.face_count() || a.vertex_count() != b.vertex_count()) {
    return incomparable(fmt::format("{} and {} faces", grouped(a.face_count()), grouped(b.face_count())));
  }
  return a.triangles() == b.triangles() ? compare_entries(a.vertices(), b.vertices()) : incomparable("other triangles");
}

Difference compare_targets(const std::optional<Target>& a, const std::optional<Target>& b) {
  const Target of_a = a.value_or(Target());
  const Target of_b = b.value_or(Target());
  if (of_a.faces != of_b.faces || of_a.box != of_b.box) {
    return incomparable(fmt::format("{} and {} faces, not the same", of_a.size(), of_b.size()));
  }
  return worst_of({compare_entries(of_a.amplitudes, of_b.amplitudes), compare_entries(of_a.shares, of_b.shares)});
}

Difference compare_arrays(const Run& a, const Run& b) {
  const auto truth = [](const Run& run) { return run.array_truth.value_or(ArrayTruth{run.array.response, 0}); };
  const auto factors_of = [](const Run& run, const ChannelResponse& response) -> Eigen::VectorXcd {
    return response.as_designed() ? Eigen::VectorXcd::Ones(run.array.size()) : factors(response);
  };
  if (a.array.size() != b.array.size()) {
    return incomparable(fmt::format("{} and {} channels", a.array.size(), b.array.size()));
  }
  if (a.array.kind != b.array.kind || a.array.directivity.kind() != b.array.directivity.kind() ||
      a.array.directivity.ka() != b.array.directivity.ka() || a.array.device != b.array.device ||
      a.array.channel != b.array.channel || truth(a).phase_levels != truth(b).phase_levels) {
    return incomparable("another kind, directivity, numbering or number of phase levels");
  }
  return worst_of({compare_entries(a.array.positions, b.array.positions), compare_entries(a.array.axes, b.array.axes),
                   compare_entries(a.array.amplitudes, b.array.amplitudes),
                   compare_complex(factors_of(a, a.array.response), factors_of(b, b.array.response)),
                   compare_complex(factors_of(a, truth(a).response), factors_of(b, truth(b).response))});
}

Difference compare_evaluations(const Run& a, const Run& b) {
  const auto name = [](const Run& run) {
    return run.evaluation_model ? fmt::format("{} by {}", run.evaluation, run.evaluation_model->scheme)
                                : run.evaluation;
  };
  if (name(a) != name(b)) {
    return incomparable(fmt::format("{} and {}", name(a), name(b)));
  }
  return !a.evaluation_model ? Difference()
                             : worst_of({compare_meshes(a.evaluation_model->mesh, b.evaluation_model->mesh),
                                         compare_targets(a.evaluation_model->target, b.evaluation_model->target)});
}

/// The evaluation's pressure of a method; where the evaluation is the solving model that may be the method's own.
const Eigen::VectorXcd& evaluated_pressure(const MethodResult& method, const Run& run) {
  return method.evaluation_pressure.size() == 0 && run.evaluation == "same" ? method.pressure
                                                                            : method.evaluation_pressure;
}

Eigen::VectorXd weights_of(const TriangleMesh& mesh, const Eigen::VectorXcd& pressure) {
  return mesh.face_count() == pressure.size() ? mesh.areas() : Eigen::VectorXd();
}

bool is_time(const MetricField& field) { return std::string_view(field.unit) == "s"; }

/// Fills the difference of two runs part by part.
class Comparison {
 public:
  Comparison(const Run& a, const Run& b) : a_(a), b_(b) {}

  RunDifference compare(const std::vector<SceneKeyChange>& scene) {
    found_.provenance = {a_.provenance, b_.provenance};
    found_.scene = scene;
    found_.models = {{"mesh", compare_meshes(a_.mesh, b_.mesh)},
                     {"array", compare_arrays(a_, b_)},
                     {"target", compare_targets(a_.target, b_.target)},
                     {"evaluation", compare_evaluations(a_, b_)}};
    for (const auto& [name, model] : found_.models) {
      count("the " + name, model, false);
    }
    pair_up("method", a_.methods, b_.methods, found_.methods_in_one_alone, std::mem_fn(&MethodResult::name),
            [&](const MethodResult& a, const MethodResult& b) { found_.methods.push_back(method(a, b)); });
    pair_up(
        "field", a_.fields, b_.fields, found_.fields_in_one_alone,
        [](const FieldResult& field) { return field.grid.name; },
        [&](const FieldResult& a, const FieldResult& b) { found_.fields.push_back(field(a, b)); });
    const auto single = [](const SolveRecord& solve) { return solve.precision == "single"; };
    const bool rough = std::ranges::any_of(a_.solves, single) || std::ranges::any_of(b_.solves, single);
    found_.rounding = rough ? kSingleRounding : kRounding;
    return std::move(found_);
  }

 private:
  /// returns   whether it is identical
  bool count(const std::string& what, const Difference& difference, bool is_result = true) {
    found_.identical = found_.identical && difference.identical;
    for (Deviation* most : {&found_.largest, is_result ? &found_.largest_result : nullptr}) {
      if (most != nullptr && difference.relative > most->relative) {
        *most = {what, difference.relative};
      }
    }
    return difference.identical;
  }

  /// Compares what both lists have by name, and counts and names the rest.
  template <class List, class Name, class Compare>
  void pair_up(const char* noun, const List& in_a, const List& in_b, std::array<std::vector<std::string>, 2>& alone,
               const Name& name, const Compare& compare) {
    for (const auto& [one, other, run] : {std::tuple{&in_a, &in_b, 0}, std::tuple{&in_b, &in_a, 1}}) {
      for (const auto& item : *one) {
        const auto same = std::ranges::find(*other, name(item), name);
        if (same == other->end()) {
          count(fmt::format("{} {} is in {} alone", noun, name(item), "AB"[run]), incomparable(""));
          alone.at(static_cast<std::size_t>(run)).push_back(name(item));
        } else if (run == 0) {
          compare(item, *same);
        }
      }
    }
  }

  MethodDifference method(const MethodResult& a, const MethodResult& b) {
    MethodDifference found{.name = a.name, .a = a.metrics, .b = b.metrics};
    const auto counted = [&](const std::string& what, const Difference& difference) {
      found.identical = count(what + " of " + a.name, difference) && found.identical;
      return difference;
    };
    found.phases = counted(
        "phases", compare_phases(a.solution.phases, a.solution.amplitudes, b.solution.phases, b.solution.amplitudes));
    found.amplitudes = counted("amplitudes", compare_entries(a.solution.amplitudes, b.solution.amplitudes));
    found.pressure = counted("pressure", compare_complex(a.pressure, b.pressure, weights_of(a_.mesh, a.pressure)));
    if (a.evaluation_pressure.size() > 0 || b.evaluation_pressure.size() > 0) {
      const Eigen::VectorXcd& evaluated = evaluated_pressure(a, a_);
      const TriangleMesh& mesh = evaluated_mesh(a_);
      found.evaluation_pressure = counted(
          "evaluation's pressure", compare_complex(evaluated, evaluated_pressure(b, b_), weights_of(mesh, evaluated)));
    }
    for (const MetricField& field : metric_fields()) {
      const double x = a.metrics.*field.value;
      const double y = b.metrics.*field.value;
      if (!is_time(field)) {
        counted(field.name, {.identical = same_value(x, y), .relative = relative_change(x, y)});
      }
    }
    return found;
  }

  FieldDifference field(const FieldResult& a, const FieldResult& b) {
    FieldDifference found{.name = a.grid.name};
    const auto counted = [&](const std::string& what, const Difference& difference) {
      found.identical = count(fmt::format("field {}{}", a.grid.name, what), difference) && found.identical;
      return difference;
    };
    if (a.grid.count != b.grid.count || a.grid.origin != b.grid.origin || a.grid.spacing != b.grid.spacing) {
      found.fault = counted(": its points", incomparable("other points")).fault;
      return found;
    }
    if (a.inside != b.inside) {
      found.fault = counted(": the points inside bodies", incomparable("other points are inside bodies")).fault;
    }
    for (const auto& [method, pressure] : a.pressure) {
      const auto other = std::ranges::find(b.pressure, method, [](const auto& entry) { return entry.first; });
      if (other != b.pressure.end()) {
        found.pressure.emplace_back(method, counted(" of " + method, compare_complex(pressure, other->second)));
      }
    }
    return found;
  }

  const Run& a_;
  const Run& b_;
  RunDifference found_;
};

template <class Kind>
Json of_both(const Kind& a, const Kind& b) {
  return {{"a", a}, {"b", b}};
}

Json value_of(const Difference& difference) {
  return {{"identical", difference.identical},
          {"relative", difference.relative},
          {"as_it_is", difference.as_it_is},
          {"turn_rad", difference.turn},
          {"fault", difference.fault}};
}

Json value_of(const Deviation& deviation) { return {{"relative", deviation.relative}, {"what", deviation.what}}; }

Json value_of(const MethodDifference& method) {
  Json metrics = Json::object();
  Json seconds = Json::object();
  for (const MetricField& field : metric_fields()) {
    const double a = method.a.*field.value;
    const double b = method.b.*field.value;
    if (is_time(field)) {
      seconds[field.name] = of_both(a, b);
    } else {
      metrics[field.name] = {{"a", a}, {"b", b}, {"difference", b - a}, {"relative", relative_change(a, b)}};
    }
  }
  return {{"name", method.name},
          {"identical", method.identical},
          {"phases",
           {{"identical", method.phases.identical},
            {"largest_rad", method.phases.relative},
            {"turn_rad", method.phases.turn},
            {"fault", method.phases.fault}}},
          {"amplitudes", value_of(method.amplitudes)},
          {"pressure", value_of(method.pressure)},
          {"evaluation_pressure", method.evaluation_pressure ? value_of(*method.evaluation_pressure) : Json()},
          {"metrics", metrics},
          {"seconds", seconds}};
}

/// Each field of both provenances, one line where they agree.
Json provenance_lines(const std::array<Provenance, 2>& of) {
  const Json a = provenance_value(of[0]);
  const Json b = provenance_value(of[1]);
  Json lines = Json::object();
  for (const auto& [name, value] : a.items()) {
    lines[name] = value == b[name] ? value : Json{"A: " + value_text(value), "B: " + value_text(b[name])};
  }
  return lines;
}

std::string methods_table(const std::vector<MethodDifference>& methods) {
  Json rows = Json::array();
  for (const MethodDifference& method : methods) {
    const Difference evaluated = method.evaluation_pressure.value_or(Difference());
    double metrics = 0;
    for (const MetricField& field : metric_fields()) {
      metrics = std::max(metrics, is_time(field) ? 0 : relative_change(method.a.*field.value, method.b.*field.value));
    }
    std::string fault;
    for (const Difference& part : {method.phases, method.amplitudes, method.pressure, evaluated}) {
      fault = fault.empty() ? part.fault : fault;
    }
    rows.push_back(Json{{"method", method.name},
                        {"phases_rad", method.phases.relative},
                        {"amplitudes", method.amplitudes.relative},
                        {"pressure", method.pressure.relative},
                        {"as_it_is", method.pressure.as_it_is},
                        {"evaluation", method.evaluation_pressure ? Json(evaluated.relative) : Json()},
                        {"metrics", metrics},
                        {"A_s", method.a.seconds_total},
                        {"B_s", method.b.seconds_total},
                        {"fault", fault}});
  }
  return rows.empty() ? "" : '\n' + table_text(rows);
}

/// The metrics that differ by more than rounding, with the sign of the change.
std::string metrics_table(const RunDifference& difference) {
  Json rows = Json::array();
  for (const MethodDifference& method : difference.methods) {
    for (const MetricField& field : metric_fields()) {
      const double a = method.a.*field.value;
      const double b = method.b.*field.value;
      const auto shown = [&](double value, const char* share) {
        return field.share ? table_number(100 * value, "{:.4g} ") + share : value_text(value, field.name);
      };
      if (!is_time(field) && relative_change(a, b) > difference.rounding) {
        rows.push_back(Json{{"method", method.name},
                            {"metric", field.name},
                            {"A", shown(a, "%")},
                            {"B", shown(b, "%")},
                            {"B - A", (b > a ? "+" : "") + shown(b - a, "points")}});
      }
    }
  }
  return rows.empty() ? "" : '\n' + table_text(rows, rows.size());
}

std::string fields_table(const std::vector<FieldDifference>& fields) {
  Json rows = Json::array();
  for (const FieldDifference& field : fields) {
    if (!field.fault.empty()) {
      rows.push_back(Json{{"field", field.name}, {"fault", field.fault}});
    }
    for (const auto& [method, pressure] : field.pressure) {
      rows.push_back(Json{{"field", field.name},
                          {"method", method},
                          {"pressure", pressure.relative},
                          {"as_it_is", pressure.as_it_is},
                          {"fault", pressure.fault}});
    }
  }
  return rows.empty() ? "" : '\n' + table_text(rows, rows.size());
}

std::string verdict_text(const RunDifference& difference) {
  const auto& [what, relative] = difference.largest;
  return difference.identical             ? "identical: models and results are the same, bit for bit"
         : !std::isfinite(relative)       ? "different: " + what
         : relative > difference.rounding ? fmt::format("different: up to {:.2g} relative, {}", relative, what)
         : what.empty()                   ? "the same except for signs of zeros"
                        : fmt::format("the same to rounding: at most {:.1e} relative, {}", relative, what);
}

}  // namespace

double relative_change(double a, double b) {
  return same_value(a, b)                       ? 0.0
         : std::isfinite(a) && std::isfinite(b) ? part_of(std::abs(a - b), std::max(std::abs(a), std::abs(b)))
                                                : kInfinite;
}

Difference compare_numbers(std::span<const double> a, std::span<const double> b) {
  Difference found = paired(a, b);
  if (!found.identical && found.fault.empty()) {
    double largest = 0.0;
    double apart = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (is_finite(a[i])) {
        largest = std::max({largest, std::abs(a[i]), std::abs(b[i])});
        apart = std::max(apart, std::abs(a[i] - b[i]));
      }
    }
    found.relative = found.as_it_is = part_of(apart, largest);
  }
  return found;
}

Difference compare_complex(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b, const Eigen::VectorXd& weights) {
  Difference found = paired(a, b);
  if (found.identical || !found.fault.empty()) {
    return found;
  }
  const Eigen::ArrayXd given = weights.size() == 0 ? Eigen::VectorXd::Ones(a.size()) : weights;
  const Eigen::ArrayXd w =
      given * a.unaryExpr([](const Complex& value) { return is_finite(value) ? 1.0 : 0.0; }).array();
  const auto known = [](const Complex& value) { return is_finite(value) ? value : Complex(0); };
  const Eigen::ArrayXcd x = a.unaryExpr(known);
  const Eigen::ArrayXcd y = b.unaryExpr(known);
  found.turn = std::arg((w * x.conjugate() * y).sum());  // 0 of an overlap of 0
  const double size = std::max((w * x.abs2()).sum(), (w * y.abs2()).sum());
  found.relative = std::sqrt(part_of((w * (y * std::polar(1.0, -found.turn) - x).abs2()).sum(), size));
  found.as_it_is = std::sqrt(part_of((w * (y - x).abs2()).sum(), size));
  return found;
}

Difference compare_phases(const Eigen::VectorXd& phases_a, const Eigen::VectorXd& amplitudes_a,
                          const Eigen::VectorXd& phases_b, const Eigen::VectorXd& amplitudes_b) {
  Difference found = paired(phases_a, phases_b);
  if (found.identical || !found.fault.empty()) {
    return found;
  }
  Complex overlap = 0.0;
  for (Eigen::Index n = 0; n < phases_a.size(); ++n) {
    const double product = amplitudes_a(n) * amplitudes_b(n);
    if (is_finite(product) && is_finite(phases_a(n))) {
      overlap += product * std::polar(1.0, phases_b(n) - phases_a(n));
    }
  }
  found.turn = std::arg(overlap);
  const auto wrapped = [](double phase) { return std::abs(std::remainder(phase, 2.0 * std::numbers::pi)); };
  for (Eigen::Index n = 0; n < phases_a.size(); ++n) {
    const bool silent = amplitudes_a(n) == 0.0 && amplitudes_b(n) == 0.0;
    if (!silent && is_finite(phases_a(n))) {
      found.relative = std::max(found.relative, wrapped(phases_b(n) - phases_a(n) - found.turn));
      found.as_it_is = std::max(found.as_it_is, wrapped(phases_b(n) - phases_a(n)));
    }
  }
  return found;
}

std::string RunDifference::verdict() const {
  return identical ? "identical" : largest.relative <= rounding ? "same_to_rounding" : "different";
}

RunDifference compare_runs(const Run& a, const Run& b, const std::vector<SceneKeyChange>& scene) {
  return Comparison(a, b).compare(scene);
}

Json difference_value(const RunDifference& difference) {
  const auto text_or_null = [](const std::optional<std::string>& text) { return text ? Json(*text) : Json(); };
  const auto& [a, b] = difference.provenance;
  Json value = {{"verdict", difference.verdict()},
                {"rounding", difference.rounding},
                {"largest", value_of(difference.largest)},
                {"largest_result", value_of(difference.largest_result)},
                {"provenance", of_both(provenance_value(a), provenance_value(b))},
                {"scene", Json::object()}};
  for (const SceneKeyChange& change : difference.scene) {
    value["scene"][change.path] = of_both(text_or_null(change.a), text_or_null(change.b));
  }
  for (const auto& [name, model] : difference.models) {
    value[name] = value_of(model);
  }
  value["methods_in_one_alone"] = of_both(difference.methods_in_one_alone[0], difference.methods_in_one_alone[1]);
  value["fields_in_one_alone"] = of_both(difference.fields_in_one_alone[0], difference.fields_in_one_alone[1]);
  value["methods"] = Json::array();
  for (const MethodDifference& method : difference.methods) {
    value["methods"].push_back(value_of(method));
  }
  value["fields"] = Json::array();
  for (const FieldDifference& field : difference.fields) {
    Json pressure = Json::object();
    for (const auto& [method, apart] : field.pressure) {
      pressure[method] = value_of(apart);
    }
    value["fields"].push_back(
        Json{{"name", field.name}, {"identical", field.identical}, {"fault", field.fault}, {"pressure", pressure}});
  }
  return value;
}

std::string describe_difference(const RunDifference& difference) {
  Json lines = provenance_lines(difference.provenance);
  lines["scene"] = Json::array();
  for (const SceneKeyChange& change : difference.scene) {
    lines["scene"].push_back(Json{{"key", change.path}, {"A", change.a.value_or("-")}, {"B", change.b.value_or("-")}});
  }
  for (const auto& [name, model] : difference.models) {
    lines[name] = model.relative == 0    ? "the same"
                  : !model.fault.empty() ? model.fault
                                         : fmt::format("differs by {:.2g} relative", model.relative);
  }
  const auto alone = [](const std::array<std::vector<std::string>, 2>& names) {
    return Json{{"in A alone:", names[0]}, {"in B alone:", names[1]}};
  };
  lines["methods"] = alone(difference.methods_in_one_alone);
  lines["fields"] = alone(difference.fields_in_one_alone);
  return lines_text(lines) + methods_table(difference.methods) + metrics_table(difference) +
         fields_table(difference.fields) + '\n' + lines_text({{"verdict", verdict_text(difference)}});
}

}  // namespace touchfield
