#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/store/run_compare.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

constexpr int kCellDigits = 2;
constexpr std::size_t kMostKeys = 40;  // at their defaults; JSON has them all
constexpr std::size_t kLongest = 60;   // of a value [bytes]

/// Without what is the same in both.
Value differing(const Value& group) {
  Value::Group rest;
  for (const auto& [name, value] : group.group()) {
    const bool none = value.is<Value::Number>() && (value.number() == 0 || !std::isfinite(value.number()));
    const bool yes = value.is<bool>() && value.flag();
    const bool zeros = value["a"].is<std::int64_t>() && value["a"].count() == 0 && value["b"].count() == 0;
    const bool identical = value["identical"].is<bool>() && value["identical"].flag();
    if (name == "faces_in_one_alone" && !zeros) {
      rest.push_back({name, fmt::format("{} and {}", value["a"].count(), value["b"].count())});
    } else if (name != "identical" && !none && !yes && !zeros && !identical) {
      rest.push_back({name, value.is<Value::Group>() && value["b"].is<std::monostate>() ? differing(value) : value});
    }
  }
  return rest;
}

/// A model's difference. Its second entry is how many faces or channels there are.
std::string model_text(const Value& model) {
  if (!model["identical"].flag()) {
    return value_text(differing(model));
  }
  const auto& [noun, count] = model.group()[1];
  return count["a"].count() == 0 ? "none" : fmt::format("the same: {} {}", value_text(count), noun);
}

Value shortened(const Value& text) {
  return text.is<std::string>() && text.text().size() > kLongest ? text.text().substr(0, kLongest - 3) + "..." : text;
}

/// "what: a -> b" of each.
Value change_texts(const Value& changes) {
  Value::List texts;
  for (const auto& [what, change] : changes.group()) {
    texts.emplace_back(
        fmt::format("{}: {}", what, value_text(Value{{"a", shortened(change["a"])}, {"b", shortened(change["b"])}})));
  }
  return texts;
}

Value scene_texts(const Value& difference) {
  Value::List texts = change_texts(difference["scene"]).list();
  if (texts.empty()) {
    texts.emplace_back("the same");
  }
  const Value& defaults = difference["scene_defaults_in_one_alone"];
  for (const auto& [side, lacks, has] : {std::tuple{"b", 'A', 'B'}, std::tuple{"a", 'B', 'A'}}) {
    Value::List keys = defaults[side].list();
    if (!keys.empty()) {
      const std::size_t count = keys.size();
      keys.resize(std::min(count, kMostKeys));
      texts.emplace_back(fmt::format("{} lacks {} key{} that {} has at {}: {}{}", lacks, count, count == 1 ? "" : "s",
                                     has, count == 1 ? "its default" : "their defaults", value_text(keys),
                                     count > kMostKeys ? ", ..." : ""));
    }
  }
  return texts;
}

Value skin_text(const Value& judged) {
  const auto told = [&](const char* side) {
    return judged[side].text() == to_string(SkinExtent::kPart) ? "the part within keep_within_mm" : "the whole skin";
  };
  return judged["a"].text() == judged["b"].text()
             ? Value()
             : fmt::format("A evaluates {}, B {}: their metrics are not comparable", told("a"), told("b"));
}

Value judge_texts(const Value& judge) {
  Value::List texts = change_texts(judge["changes"]).list();
  for (const char* part : {"mesh", "target"}) {
    if (!judge[part].empty()) {
      texts.emplace_back(fmt::format("{}: {}", part, model_text(judge[part])));
    }
  }
  return texts;
}

Value only_texts(const Value& only) {
  Value::List texts;
  for (const auto& [side, run] : {std::pair{"a", 'A'}, std::pair{"b", 'B'}}) {
    if (!only[side].empty()) {
      texts.emplace_back(fmt::format("in {} alone: {}", run, value_text(only[side])));
    }
  }
  return texts;
}

/// A number of few digits.
Value cell(const Value& value) { return value.is<Value::Number>() ? Value(value.number(), kCellDigits) : value; }

std::string methods_text(const Value::List& methods) {
  Value::List rows;
  std::string remarks;
  for (const Value& method : methods) {
    double metrics = 0;
    for (const auto& [name, pair] : method["metrics"].group()) {
      metrics = std::max(metrics, pair["relative"].number());
    }
    const Value& seconds = method["seconds"].group().back().value;
    rows.push_back(Value{{"method", method["name"]},
                         {"phases_rad", cell(method["phases"]["largest_rad"])},
                         {"rms_rad", cell(method["phases"]["rms_rad"])},
                         {"amplitudes", cell(method["amplitudes"]["relative"])},
                         {"pressure", cell(method["pressure"]["relative"])},
                         {"as_it_is", cell(method["pressure"]["as_it_is"])},
                         {"judge", cell(method["judge_pressure"]["relative"])},
                         {"metrics", {metrics, kCellDigits}},
                         {"A_s", seconds["a"]},
                         {"B_s", seconds["b"]}});
    Value::Group said = method["changes"].group();
    for (const auto& [name, part] : method.group()) {
      if (!part["fault"].empty() && name != "cost") {
        said.push_back({name, part["fault"]});
      }
    }
    const Value& length = method["cost"]["length"];
    if (length["a"].count() != length["b"].count()) {
      said.push_back({"values of the cost", length});
    }
    remarks += said.empty() ? "" : fmt::format("  {}: {}\n", method["name"].text(), value_text(said));
  }
  return rows.empty() ? "" : '\n' + table_text(rows) + remarks;
}

/// The metrics that differ by more than rounding.
std::string metrics_text(const Value& difference) {
  std::string text;
  for (const Value& method : difference["methods"].list()) {
    Value::Group changed;
    for (const auto& [name, pair] : method["metrics"].group()) {
      if (pair["relative"].number() > difference["rounding"].number()) {
        changed.push_back({name, Value{{"a", pair["a"]}, {"b", pair["b"]}}});
      }
    }
    text += changed.empty() ? "" : fmt::format("\nmetrics of {}\n{}", method["name"].text(), lines_text(changed));
  }
  return text;
}

std::string fields_text(const Value::List& fields) {
  Value::List rows;
  std::string remarks;
  for (const Value& field : fields) {
    const std::string& name = field["name"].text();
    for (const auto& [method, pressure] : field["pressure"].group()) {
      rows.push_back(Value{{"field", name},
                           {"method", method},
                           {"pressure", cell(pressure["relative"])},
                           {"as_it_is", cell(pressure["as_it_is"])},
                           {"fault", pressure["fault"]}});
    }
    remarks += field["fault"].empty() ? "" : fmt::format("  field {}: {}\n", name, field["fault"].text());
    const std::int64_t inside = field["inside_in_one_alone"].count();
    remarks +=
        inside == 0 ? "" : fmt::format("  field {}: {} points are inside a body in one run only\n", name, inside);
  }
  const std::string table = rows.empty() ? "" : table_text(rows);
  return table.empty() && remarks.empty() ? "" : '\n' + table + remarks;
}

std::string verdict_text(const Value& difference) {
  const std::string& verdict = difference["verdict"].text();
  const std::string& what = difference["largest"]["what"].text();
  const double relative = difference["largest"]["relative"].number();
  if (verdict == "identical") {
    return "identical: models and results are the same, bit for bit";
  }
  if (verdict == "different") {
    return std::isfinite(relative) ? fmt::format("different: up to {:.2g} relative, {}", relative, what)
                                   : fmt::format("different: {}", what);
  }
  return what.empty() ? "the same except for texts and signs of zeros"
                      : fmt::format("the same to rounding: at most {:.1e} relative, {}", relative, what);
}

}  // namespace

std::string describe_difference(const Value& difference) {
  Value::Group origin = difference["provenance"].group();
  if (!difference["scene"].empty()) {
    std::erase_if(origin, [](const NamedValue& change) { return change.name == "scene_hash"; });
  }
  Value models = std::move(origin);
  models.add({{"scene", scene_texts(difference)},
              {"mesh", model_text(difference["mesh"])},
              {"array", model_text(difference["array"])},
              {"target", model_text(difference["target"])},
              {"skin", skin_text(difference["judged_skin"])},
              {"judge", judge_texts(difference["judge"])},
              {"solve", change_texts(difference["solvers"])},
              {"warnings", only_texts(difference["warnings_in_one_alone"])},
              {"notes", only_texts(difference["notes_in_one_alone"])},
              {"methods", only_texts(difference["methods_in_one_alone"])},
              {"fields", only_texts(difference["fields_in_one_alone"])}});
  return lines_text(models) + methods_text(difference["methods"].list()) + metrics_text(difference) +
         fields_text(difference["fields"].list()) + '\n' +
         lines_text({{"verdict", verdict_text(difference)}, {"cause", difference["causes"]}});
}

}  // namespace touchfield
