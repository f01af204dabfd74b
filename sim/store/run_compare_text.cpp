#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/store/run_compare.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

constexpr double kMillimetresInAMetre = 1e3;
constexpr double kDegreesInARadian = 180.0 / std::numbers::pi;
constexpr std::size_t kMostKeys = 40;  // of the scene; JSON has them all
constexpr std::size_t kLongest = 60;   // of a value [bytes]
constexpr std::size_t kMostInALine = 80;

/// A line as `info` writes them: a word, then what there is to say.
std::string line(const std::string& label, const std::string& text) { return fmt::format("{:<9} {}\n", label, text); }

std::string shortened(const std::optional<std::string>& text) {
  if (!text) {
    return "(absent)";
  }
  if (text->empty()) {
    return "(empty)";
  }
  return text->size() <= kLongest ? *text : text->substr(0, kLongest - 3) + "...";
}

/// Both texts in one line, or in two where that would be long.
std::string change_lines(const std::string& label, const std::string& a, const std::string& b) {
  if (a.size() + b.size() <= kMostInALine) {
    return line(label, fmt::format("{} -> {}", a.empty() ? "(empty)" : a, b.empty() ? "(empty)" : b));
  }
  return line(label, "A: " + a) + line("", "B: " + b);
}

std::string provenance_lines(const std::vector<TextChange>& changes, bool scene_changed) {
  std::string text;
  for (const TextChange& change : changes) {
    if (change.what != "scene_hash" || !scene_changed) {
      text += change_lines(change.what == "command_line" ? "command" : change.what, *change.a, *change.b);
    }
  }
  return text;
}

std::string defaults_line(const std::vector<std::string>& keys, char lacks, char has) {
  if (keys.empty()) {
    return "";
  }
  const std::size_t told = std::min(keys.size(), kMostKeys);
  const auto end = keys.begin() + static_cast<std::ptrdiff_t>(told);
  return line(
      "", fmt::format("{} lacks {} key{} that {} has at {} default{}: {}{}", lacks, keys.size(),
                      keys.size() == 1 ? "" : "s", has, keys.size() == 1 ? "its" : "their", keys.size() == 1 ? "" : "s",
                      fmt::join(keys.begin(), end, ", "), told == keys.size() ? "" : ", ..."));
}

std::string scene_lines(const SceneDifference& scene) {
  const std::vector<TextChange>& changes = scene.changes;
  std::string text = changes.empty() ? line("scene", "the same") : "";
  for (std::size_t i = 0; i < std::min(changes.size(), kMostKeys); ++i) {
    const TextChange& change = changes[i];
    text +=
        line(i == 0 ? "scene" : "", fmt::format("{}: {} -> {}", change.what, shortened(change.a), shortened(change.b)));
  }
  if (changes.size() > kMostKeys) {
    text += line("", fmt::format("and {} more keys", changes.size() - kMostKeys));
  }
  return text + defaults_line(scene.at_defaults.b, 'A', 'B') + defaults_line(scene.at_defaults.a, 'B', 'A');
}

std::string millimetres(double metres) { return fmt::format("{:.4g} mm", kMillimetresInAMetre * metres); }

/// Below a billionth of a millimetre or of a degree there is nothing but rounding.
double without_rounding(double value) { return std::abs(value) < 1e-9 ? 0.0 : value; }

std::string motion_text(const MeshMotion& motion) {
  const Vector3 shift = (kMillimetresInAMetre * motion.shift).unaryExpr(&without_rounding);
  const double angle = without_rounding(kDegreesInARadian * motion.angle);
  const double rest = without_rounding(kMillimetresInAMetre * motion.residual);
  const std::string moved = fmt::format("shifted by ({:.4g}, {:.4g}, {:.4g}) mm{}", shift.x(), shift.y(), shift.z(),
                                        angle > 0.0 ? fmt::format(" and turned by {:.4g} deg", angle) : "");
  return rest > 0.0 ? fmt::format("deformed by up to {:.4g} mm when {}", rest, moved) : moved + " as a whole";
}

std::string mesh_text(const MeshDifference& mesh) {
  if (mesh.identical) {
    return fmt::format("the same: {} faces", grouped(mesh.faces.first));
  }
  if (!mesh.same_triangles) {
    const std::string reach =
        mesh.distance ? fmt::format("; vertices up to {} apart", millimetres(*mesh.distance)) : "";
    return fmt::format("another: {} -> {} faces, {} -> {} vertices{}", grouped(mesh.faces.first),
                       grouped(mesh.faces.second), grouped(mesh.vertices.first), grouped(mesh.vertices.second), reach);
  }
  return fmt::format("the same {} faces with vertices up to {} apart: {}", grouped(mesh.faces.first),
                     millimetres(*mesh.distance), motion_text(*mesh.motion));
}

std::string array_text(const ArrayDifference& array) {
  if (array.identical) {
    return fmt::format("the same: {} channel{}", array.channels.first, array.channels.first == 1 ? "" : "s");
  }
  std::vector<std::string> parts;
  for (const TextChange& change : array.texts) {
    parts.push_back(fmt::format("{} {} -> {}", change.what, shortened(change.a), shortened(change.b)));
  }
  if (!array.distance) {
    parts.push_back(fmt::format("{} -> {} channels", array.channels.first, array.channels.second));
    return fmt::format("{}", fmt::join(parts, "; "));
  }
  if (!array.same_numbering) {
    parts.emplace_back("other numbers of devices or channels");
  }
  if (*array.distance > 0.0) {
    parts.push_back(fmt::format("channels up to {} apart", millimetres(*array.distance)));
  }
  if (*array.tilt > 0.0) {
    parts.push_back(fmt::format("axes up to {:.4g} deg apart", kDegreesInARadian * *array.tilt));
  }
  for (const auto& [what, numbers] :
       {std::pair{"amplitudes", &array.amplitudes}, std::pair{"responses", &array.responses},
        std::pair{"true responses", &array.true_responses}}) {
    if (numbers->relative > 0.0) {
      parts.push_back(fmt::format("{} differ by {:.1e}", what, numbers->relative));
    }
  }
  return parts.empty() ? "the same except for signs of zeros" : fmt::format("{}", fmt::join(parts, "; "));
}

std::string target_text(const TargetDifference& target) {
  if (target.faces == std::pair<Eigen::Index, Eigen::Index>(0, 0)) {
    return "none";
  }
  if (target.identical) {
    return fmt::format("the same: {} faces", target.faces.first);
  }
  if (target.relative == 0.0) {
    return fmt::format("the same {} faces, in other boxes or with signs of zeros", target.faces.first);
  }
  std::string text = fmt::format("{} -> {} faces", target.faces.first, target.faces.second);
  if (target.only_faces.first + target.only_faces.second > 0) {
    text += fmt::format(", {} in A alone, {} in B alone", target.only_faces.first, target.only_faces.second);
  }
  return target.amplitudes.relative > 0.0
             ? text + fmt::format("; amplitudes differ by {:.1e}", target.amplitudes.relative)
             : text;
}

std::string judge_lines(const JudgeDifference& judge) {
  std::string text;
  for (const TextChange& change : judge.texts) {
    text +=
        line("judge", fmt::format("{}{} -> {}", change.what == "judge" ? "" : change.what + " ", *change.a, *change.b));
  }
  if (judge.mesh) {
    text += line("judge", "mesh: " + mesh_text(*judge.mesh));
    text += line("judge", "target: " + target_text(*judge.target));
  }
  return text;
}

std::string skin_line(const std::pair<SkinExtent, SkinExtent>& judged) {
  const auto [a, b] = judged;
  const auto told = [](SkinExtent extent) {
    return extent == SkinExtent::kPart ? "the part within keep_within_mm" : "the whole skin";
  };
  return a == b ? ""
                : line("skin", fmt::format("A evaluates {}, B {}: their metrics are not comparable", told(a), told(b)));
}

std::string only_lines(const std::string& label, const OnlyIn& only) {
  std::string text;
  if (!only.a.empty()) {
    text += line(label, fmt::format("in A alone: {}", fmt::join(only.a, ", ")));
  }
  if (!only.b.empty()) {
    text += line(label, fmt::format("in B alone: {}", fmt::join(only.b, ", ")));
  }
  return text;
}

/// A relative difference in a table.
std::string cell(double difference) {
  return difference == 0.0 ? "0" : std::isfinite(difference) ? fmt::format("{:.1e}", difference) : "!";
}

double largest_of(const std::vector<NumberPair>& pairs) {
  double largest = 0.0;
  for (const NumberPair& pair : pairs) {
    largest = std::max(largest, pair.relative);
  }
  return largest;
}

std::string methods_lines(const std::vector<MethodDifference>& methods) {
  const bool judged =
      std::ranges::any_of(methods, [](const auto& method) { return method.judge_pressure.has_value(); });
  std::vector<std::string> header = {"method", "phases [rad]", "rms [rad]", "amplitudes", "pressure", "as it is"};
  if (judged) {
    header.emplace_back("judge");
  }
  header.insert(header.end(), {"metrics", "A [s]", "B [s]"});
  std::vector<std::vector<std::string>> rows = {header};
  for (const MethodDifference& method : methods) {
    std::vector<std::string> row = {method.name,
                                    cell(method.phases.largest),
                                    cell(method.phases.rms),
                                    cell(method.amplitudes.relative),
                                    cell(method.pressure.relative),
                                    cell(method.pressure.as_is)};
    if (judged) {
      row.push_back(method.judge_pressure ? cell(method.judge_pressure->relative) : "-");
    }
    row.push_back(cell(largest_of(method.metrics)));
    for (const double NumberPair::*side : {&NumberPair::a, &NumberPair::b}) {
      row.push_back(table_number(method.seconds.back().*side, "{:.2f}"));
    }
    rows.push_back(row);
  }
  return aligned_table(rows);
}

/// What a method's row of the table cannot say.
std::string method_remarks(const MethodDifference& method) {
  std::vector<std::string> remarks;
  for (const TextChange& change : method.texts) {
    remarks.push_back(fmt::format("{} {} -> {}", change.what, *change.a, *change.b));
  }
  if (method.cost_length.first != method.cost_length.second) {
    remarks.push_back(
        fmt::format("cost history of {} -> {} values", method.cost_length.first, method.cost_length.second));
  }
  const auto add_fault = [&](const char* what, const std::string& fault) {
    if (!fault.empty()) {
      remarks.push_back(fmt::format("{}: {}", what, fault));
    }
  };
  add_fault("phases", method.phases.fault);
  add_fault("amplitudes", method.amplitudes.fault);
  add_fault("pressure", method.pressure.fault);
  add_fault("judge's pressure", method.judge_pressure ? method.judge_pressure->fault : "");
  return remarks.empty() ? "" : fmt::format("  {}: {}\n", method.name, fmt::join(remarks, "; "));
}

/// The metrics that differ by more than rounding.
std::string metrics_lines(const std::vector<MethodDifference>& methods, double rounding) {
  std::vector<std::vector<std::string>> rows = {{"method", "metric", "A", "B", "relative"}};
  for (const MethodDifference& method : methods) {
    for (const NumberPair& metric : method.metrics) {
      if (metric.relative > rounding) {
        rows.push_back({method.name, metric.name, table_number(metric.a, "{:.6g}"), table_number(metric.b, "{:.6g}"),
                        cell(metric.relative)});
      }
    }
  }
  return rows.size() == 1 ? "" : '\n' + aligned_table(rows, {1});
}

std::string fields_lines(const std::vector<FieldDifference>& fields) {
  std::vector<std::vector<std::string>> rows = {{"field", "method", "pressure", "as it is"}};
  std::string remarks;
  for (const FieldDifference& field : fields) {
    for (const auto& [method, pressure] : field.pressure) {
      rows.push_back({field.name, method, cell(pressure.relative), cell(pressure.as_is)});
      if (!pressure.fault.empty()) {
        remarks += fmt::format("  {} of {}: {}\n", field.name, method, pressure.fault);
      }
    }
    if (!field.fault.empty()) {
      remarks += fmt::format("  field {}: {}\n", field.name, field.fault);
    }
    if (field.inside > 0) {
      remarks += fmt::format("  field {}: {} of {} points are inside a body in one run only\n", field.name,
                             field.inside, field.points);
    }
  }
  const std::string table = rows.size() == 1 ? "" : aligned_table(rows, {1});
  return table.empty() && remarks.empty() ? "" : '\n' + table + remarks;
}

std::string verdict_lines(const RunDifference& difference) {
  const Deviation& largest = difference.largest;
  std::string text;
  switch (difference.verdict) {
    case Verdict::kIdentical:
      return line("verdict", "identical: models and results are the same, bit for bit");
    case Verdict::kRounding:
      text = largest.what.empty()
                 ? "the same except for texts and signs of zeros"
                 : fmt::format("the same to rounding: at most {:.1e} relative, {}", largest.relative, largest.what);
      break;
    case Verdict::kDifferent:
      text = std::isfinite(largest.relative)
                 ? fmt::format("different: up to {:.2g} relative, {}", largest.relative, largest.what)
                 : fmt::format("different: {}", largest.what);
      break;
  }
  text = line("verdict", text);
  for (const std::string& cause : difference.causes) {
    text += line(&cause == &difference.causes.front() ? "cause" : "or", cause);
  }
  return text;
}

}  // namespace

std::string describe_difference(const RunDifference& difference) {
  std::string text = provenance_lines(difference.provenance,
                                      !difference.scene.changes.empty() || !difference.scene.at_defaults.empty());
  text += scene_lines(difference.scene);
  text += line("mesh", mesh_text(difference.mesh));
  text += line("array", array_text(difference.array));
  text += line("target", target_text(difference.target));
  text += skin_line(difference.judged_skin);
  text += judge_lines(difference.judge);
  for (const TextChange& change : difference.solvers) {
    text += line("solve", fmt::format("{}: {} -> {}", change.what, *change.a, *change.b));
  }
  text += only_lines("warnings", difference.warnings);
  text += only_lines("notes", difference.notes);
  text += only_lines("methods", difference.methods);
  text += only_lines("fields", difference.fields);
  if (!difference.both_methods.empty()) {
    text += '\n' + methods_lines(difference.both_methods);
    for (const MethodDifference& method : difference.both_methods) {
      text += method_remarks(method);
    }
    text += metrics_lines(difference.both_methods, difference.rounding);
  }
  return text + fields_lines(difference.both_fields) + '\n' + verdict_lines(difference);
}

}  // namespace touchfield
