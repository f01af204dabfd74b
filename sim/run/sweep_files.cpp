#include "sim/run/sweep_files.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/run/archive_file.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

constexpr const char* kRecordChecksum = "crc32";  // of the rest of the record, as one line

/// What a record has beside its inputs, methods and files: for case.json, written and read, and the table.
template <class Record, class Visit>
void visit_ends(Record& record, const Visit& visit) {
  visit("faces", record.faces);
  visit("channels", record.channels);
  visit("seconds", record.seconds);
  visit("revision", record.revision);
}

/// The same of a method, in front of its metrics.
template <class Method, class Visit>
void visit_names(Method& method, const Visit& visit) {
  visit("name", method.name);
  visit("method", method.method);
  visit("scheme", method.scheme);
}

/// JSON has no NaN: what was not computed is null.
void read_value(const Json& json, double& value) { value = json.is_null() ? kNotComputed : json.get<double>(); }
template <class Value>
void read_value(const Json& json, Value& value) {
  value = json.get<Value>();
}

/// What motions have beside metrics, in the order of the first one.
std::vector<std::string> over_motion(const SweepSummary& summary) {
  std::vector<std::string> names;
  for (const SweepRow& row : sweep_rows(summary)) {
    for (std::size_t i = 0; row.method != nullptr && i < row.method->over_motion.size(); ++i) {
      const std::string& name = row.method->over_motion[i].first;
      if (std::ranges::find(names, name) == names.end()) {
        names.push_back(name);
      }
    }
  }
  return names;
}

/// A line of the table, of which a method may be missing.
Json line_of(const SweepSummary& summary, const std::vector<std::string>& motions, const SweepRecord& record,
             const SweepRecord::Method& method) {
  Json line = {{"case", record.number}, {"status", record.status}};
  for (const std::string& path : summary.parameters) {
    line[column_of(path)] = input_of(record, path).value_or("");
  }
  const auto add = [&](const char* name, const auto& value) { line[name] = value; };
  visit_names(method, add);
  for (const MetricField& field : metric_fields()) {
    line[field.name] = method.metrics.*field.value;
  }
  for (const std::string& name : motions) {
    const auto found = std::ranges::find(method.over_motion, name, &std::pair<std::string, double>::first);
    line[name] = found != method.over_motion.end() ? found->second : kNotComputed;
  }
  line["method_status"] = method.status;
  visit_ends(record, add);
  line["reason"] = record.reason;
  return line;
}

}  // namespace

std::string column_of(const std::string& parameter) { return parameter == "name" ? "scene.name" : parameter; }

std::vector<SweepRow> sweep_rows(const SweepSummary& summary) {
  std::vector<SweepRow> rows;
  for (const SweepRecord& record : summary.records) {
    for (const SweepRecord::Method& method : record.methods) {
      rows.push_back({&record, &method});
    }
    if (record.methods.empty()) {
      rows.push_back({&record, nullptr});
    }
  }
  return rows;
}

std::optional<std::string> input_of(const SweepRecord& record, const std::string& path) {
  const auto found = std::ranges::find(record.inputs, path, &std::pair<std::string, std::string>::first);
  return found != record.inputs.end() ? std::optional(found->second) : std::nullopt;
}

std::optional<std::vector<double>> parameter_numbers(const std::string& path, const std::vector<SweepRow>& rows) {
  std::vector<double> numbers;
  for (const SweepRow& row : rows) {
    const auto text = input_of(*row.record, path);
    const auto number = text ? number_of<double>(*text) : std::optional(kNotComputed);
    if (!number) {
      return std::nullopt;
    }
    numbers.push_back(*number);
  }
  return numbers;
}

std::string to_json(const SweepRecord& record, int indent) {
  Json json = {{"case", record.number},
               {"inputs", Json::object()},
               {"status", record.status},
               {"reason", record.reason},
               {"methods", Json::array()}};
  for (const auto& [path, value] : record.inputs) {
    json["inputs"][path] = value;
  }
  for (const SweepRecord::Method& method : record.methods) {
    Json& entry = json["methods"].emplace_back(Json::object());
    visit_names(method, [&](const char* name, const std::string& value) { entry[name] = value; });
    entry["status"] = method.status;
    for (const MetricField& field : metric_fields()) {
      entry["metrics"][field.name] = method.metrics.*field.value;
    }
    for (const auto& [name, value] : method.over_motion) {
      entry["over_motion"][name] = value;
    }
  }
  visit_ends(record, [&](const char* name, const auto& value) { json[name] = value; });
  json["warnings"] = record.warnings;
  json["files"] = Json::object();
  for (const SweepRecord::File& file : record.files) {
    json["files"][file.name] = {{"bytes", file.bytes}, {"crc32", file.crc32}};
  }
  json[kRecordChecksum] = checksum(json_text(json));
  return json_text(json, indent) + "\n";
}

SweepRecord record_from_json(const std::string& text, const std::string& path) {
  try {
    Json json = json_from_text<Json>(text);
    const auto written = json.at(kRecordChecksum).get<std::string>();
    json.erase(kRecordChecksum);
    if (checksum(json_text(json)) != written) {
      throw IoError(fmt::format("{}: its checksum has changed", path));
    }
    SweepRecord record;
    record.number = json.at("case").get<int>();
    for (const auto& [key, value] : json.at("inputs").items()) {
      record.inputs.emplace_back(key, value.get<std::string>());
    }
    record.status = json.at("status").get<std::string>();
    record.reason = json.at("reason").get<std::string>();
    for (const Json& entry : json.at("methods")) {
      SweepRecord::Method& method = record.methods.emplace_back();
      visit_names(method, [&](const char* name, std::string& value) { value = entry.at(name).get<std::string>(); });
      method.status = entry.at("status").get<std::string>();
      for (const MetricField& field : metric_fields()) {
        read_value(entry.at("metrics").value(field.name, Json()), method.metrics.*field.value);
      }
      const Json over_motion = entry.value("over_motion", Json::object());
      for (const auto& [name, value] : over_motion.items()) {
        read_value(value, method.over_motion.emplace_back(name, kNotComputed).second);
      }
    }
    visit_ends(record, [&](const char* name, auto& value) { read_value(json.at(name), value); });
    record.warnings = json.at("warnings").get<std::vector<std::string>>();
    for (const auto& [name, file] : json.at("files").items()) {
      record.files.push_back({name, file.at("bytes").get<std::uintmax_t>(), file.at("crc32").get<std::string>()});
    }
    return record;
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("{}: not the record of a case: {}", path, error.what()));
  }
}

Json sweep_columns(const SweepSummary& summary) { return line_of(summary, over_motion(summary), {}, {}); }

Json sweep_lines(const SweepSummary& summary) {
  const std::vector<std::string> motions = over_motion(summary);
  Json lines = Json::array();
  for (const SweepRow& row : sweep_rows(summary)) {
    lines.push_back(
        line_of(summary, motions, *row.record, row.method != nullptr ? *row.method : SweepRecord::Method()));
  }
  return lines;
}

void write_sweep_csv(const std::string& path, const SweepSummary& summary) {
  write_text_file(path, csv_text(sweep_columns(summary), sweep_lines(summary)));
}

std::string sweep_table(const SweepSummary& summary, std::size_t most) {
  std::vector<std::string> parameters;  // what is the same everywhere only takes room
  for (const std::string& parameter : summary.parameters) {
    const auto differs = [&](const SweepRecord& record) {
      return input_of(record, parameter) != input_of(summary.records.front(), parameter);
    };
    if (std::ranges::any_of(summary.records, differs)) {
      parameters.push_back(parameter);
    }
  }
  std::vector<std::string> header = {"case"};
  header.insert(header.end(), parameters.begin(), parameters.end());
  for (const char* name :
       {"method", "error", "of P", "width [mm]", "of P", "leakage", "force [mN]", "seconds", "status"}) {
    header.emplace_back(name);
  }
  std::vector<std::vector<std::string>> lines = {header};
  const std::vector<SweepRow> rows = sweep_rows(summary);
  const std::size_t head = rows.size() <= most ? rows.size() : most / 2;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i == head && rows.size() > most) {
      std::vector<std::string> gap(header.size());
      gap.front() = "...";
      lines.push_back(gap);
      i = rows.size() - (most - head);
    }
    const SweepRow& row = rows[i];
    const Metrics metrics = row.method != nullptr ? row.method->metrics : Metrics();
    std::vector<std::string> line = {fmt::format("{}", row.record->number)};
    for (const std::string& parameter : parameters) {
      line.push_back(input_of(*row.record, parameter).value_or("-"));
    }
    line.push_back(row.method != nullptr ? row.method->name : "-");
    line.push_back(table_number(100.0 * metrics.relative_error, "{:.2f} %"));
    line.push_back(table_number(100.0 * metrics.relative_error_radiation, "{:.2f} %"));
    line.push_back(table_number(metrics.width_mm, "{:.2f}"));
    line.push_back(table_number(metrics.width_radiation_mm, "{:.2f}"));
    line.push_back(table_number(100.0 * metrics.leakage, "{:.2f} %"));
    line.push_back(table_number(1e3 * metrics.force_target_n, "{:.3g}"));
    line.push_back(table_number(row.record->seconds, "{:.1f}"));
    line.push_back(row.record->status == "ok" ? row.method != nullptr ? row.method->status : "ok" : "FAILED");
    lines.push_back(std::move(line));
  }
  return aligned_table(lines);
}

}  // namespace touchfield
