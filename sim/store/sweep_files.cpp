#include "sim/store/sweep_files.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <type_traits>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/text_number.h"
#include "sim/store/archive_file.h"
#include "sim/store/checksum.h"
#include "sim/store/hdf5_file.h"
#include "sim/store/run_archive.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kRecordChecksum = "crc32";  // of the rest of the record, as one line

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double json_number(const Json& json) { return json.is_null() ? kNotComputed : json.get<double>(); }

/// A column of the table: a number, a count or a text of each line.
struct Column {
  using Number = std::function<double(const SweepRow&)>;
  using Count = std::function<std::int64_t(const SweepRow&)>;
  using Text = std::function<std::string(const SweepRow&)>;

  std::string name;
  std::string group;  // of sweep.h5; empty: the root
  std::string unit;
  std::variant<Number, Count, Text> value;
};

constexpr const char* kInputs = "inputs";  // group of the parameters
constexpr const char* kMotion = "motion";  // group of what became of metrics over a motion

double over_motion(const SweepRecord::Method& method, const std::string& name) {
  const auto found = std::ranges::find(method.over_motion, name, &std::pair<std::string, double>::first);
  return found != method.over_motion.end() ? found->second : kNotComputed;
}

/// Of all motions in the order of the first one.
std::vector<std::string> motion_columns(const SweepSummary& summary) {
  std::vector<std::string> names;
  for (const SweepRecord& record : summary.records) {
    for (const SweepRecord::Method& method : record.methods) {
      for (const auto& [name, value] : method.over_motion) {
        if (std::ranges::find(names, name) == names.end()) {
          names.push_back(name);
        }
      }
    }
  }
  return names;
}

/// The unit of a metric's summary; of times and counts their own.
std::string motion_unit(const std::string& name) {
  const std::string what = name.substr(0, name.rfind('_'));
  if (name.ends_with("_count")) {
    return "1";
  }
  for (const MetricField& field : metric_fields()) {
    if (field.name == what) {
      return field.unit;
    }
  }
  return what == "displacement_m" ? "m" : what == "age_s" || what == "latency_s" || what == "frame_seconds" ? "s" : "1";
}

std::vector<Column> columns_of(const SweepSummary& summary) {
  const auto text_of = [](std::string SweepRecord::Method::*member) {
    return Column::Text([member](const SweepRow& row) { return row.method != nullptr ? row.method->*member : ""; });
  };
  std::vector<Column> columns = {
      {"case", "", "1", Column::Count([](const SweepRow& row) { return row.record->number; })},
      {"status", "", "text", Column::Text([](const SweepRow& row) { return row.record->status; })}};
  for (const std::string& parameter : summary.parameters) {
    columns.push_back({parameter, kInputs, "text", Column::Text([parameter](const SweepRow& row) {
                         return input_of(*row.record, parameter).value_or("");
                       })});
  }
  columns.push_back({"name", "", "text", text_of(&SweepRecord::Method::name)});
  columns.push_back({"method", "", "text", text_of(&SweepRecord::Method::method)});
  columns.push_back({"scheme", "", "text", text_of(&SweepRecord::Method::scheme)});
  columns.push_back(
      {"judged_skin", "", "text", Column::Text([](const SweepRow& row) { return row.record->judged_skin; })});
  for (const MetricField& field : metric_fields()) {
    columns.push_back({field.name, "metrics", field.unit, Column::Number([value = field.value](const SweepRow& row) {
                         return row.method != nullptr ? row.method->metrics.*value : kNotComputed;
                       })});
  }
  for (const std::string& name : motion_columns(summary)) {
    columns.push_back({name, kMotion, motion_unit(name), Column::Number([name](const SweepRow& row) {
                         return row.method != nullptr ? over_motion(*row.method, name) : kNotComputed;
                       })});
  }
  const auto count = [](int SweepRecord::*member) {
    return Column::Count([member](const SweepRow& row) { return row.record->*member; });
  };
  const std::vector<Column> rest = {
      {"method_status", "", "text", text_of(&SweepRecord::Method::status)},
      {"faces", "", "1", count(&SweepRecord::faces)},
      {"channels", "", "1", count(&SweepRecord::channels)},
      {"seconds", "", "s", Column::Number([](const SweepRow& row) { return row.record->seconds; })},
      {"peak_mib", "", "MiB", Column::Number([](const SweepRow& row) { return row.record->peak_mib; })},
      {"models", "", "1", count(&SweepRecord::models)},
      {"models_reused", "", "1", count(&SweepRecord::models_reused)},
      {"revision", "", "text", Column::Text([](const SweepRow& row) { return row.record->revision; })},
      {"reason", "", "text", Column::Text([](const SweepRow& row) { return row.record->reason; })}};
  columns.insert(columns.end(), rest.begin(), rest.end());
  return columns;
}

std::string csv_cell(const Column& column, const SweepRow& row) {
  return std::visit(
      [&](const auto& value) {
        const auto field = value(row);
        if constexpr (std::is_same_v<std::decay_t<decltype(field)>, std::string>) {
          return field;
        } else if constexpr (std::is_same_v<std::decay_t<decltype(field)>, double>) {
          return csv_number(field);
        } else {
          return fmt::format("{}", field);
        }
      },
      column.value);
}

/// A parameter whose values are all numbers is one of numbers.
SweepColumn filled(const Column& column, const std::vector<SweepRow>& rows) {
  if (auto numbers = column.group == kInputs ? parameter_numbers(column.name, rows) : std::nullopt) {
    return {column.name, "as in the scene", std::move(*numbers)};
  }
  return std::visit(
      [&](const auto& value) {
        std::vector<decltype(value(rows.front()))> values;
        values.reserve(rows.size());
        std::ranges::transform(rows, std::back_inserter(values), value);
        return SweepColumn{column.name, column.unit, std::move(values)};
      },
      column.value);
}

void write_column(const hdf5::Group& group, const SweepColumn& column) {
  std::visit(
      [&](const auto& values) {
        if constexpr (std::is_same_v<std::decay_t<decltype(values)>, std::vector<std::string>>) {
          group.write_texts(column.name, values);
        } else {
          group.write(column.name, values.data(), {values.size()}, column.unit);
        }
      },
      column.values);
}

}  // namespace

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
  Json inputs = Json::object();
  for (const auto& [path, value] : record.inputs) {
    inputs[path] = value;
  }
  Json methods = Json::array();
  for (const SweepRecord::Method& method : record.methods) {
    Json metrics = Json::object();
    for (const MetricField& field : metric_fields()) {
      metrics[field.name] = number_json(method.metrics.*field.value);
    }
    methods.push_back({{"name", method.name},
                       {"method", method.method},
                       {"scheme", method.scheme},
                       {"status", method.status},
                       {"metrics", metrics}});
    for (const auto& [name, value] : method.over_motion) {
      methods.back()["over_motion"][name] = number_json(value);
    }
  }
  Json files = Json::object();
  for (const SweepRecord::File& file : record.files) {
    files[file.name] = {{"bytes", file.bytes}, {"crc32", file.crc32}};
  }
  Json json = {{"case", record.number},
               {"inputs", inputs},
               {"status", record.status},
               {"reason", record.reason},
               {"methods", methods},
               {"judged_skin", record.judged_skin},
               {"faces", record.faces},
               {"channels", record.channels},
               {"seconds", number_json(record.seconds)},
               {"peak_mib", number_json(record.peak_mib)},
               {"models", record.models},
               {"models_reused", record.models_reused},
               {"warnings", record.warnings},
               {"revision", record.revision},
               {"files", files}};
  json[kRecordChecksum] = checksum(json_text(json));
  return json_text(json, indent) + "\n";
}

SweepRecord record_from_json(const std::string& text, const std::string& path) {
  try {
    Json json = json_from_text<Json>(text);
    const auto written = json.at(kRecordChecksum).get<std::string>();
    json.erase(kRecordChecksum);
    if (checksum(json_text(json)) != written) {
      throw IoError(fmt::format("{}: its checksum is not what it was", path));
    }
    SweepRecord record;
    record.number = json.at("case").get<int>();
    for (const auto& [key, value] : json.at("inputs").items()) {
      record.inputs.emplace_back(key, value.get<std::string>());
    }
    record.status = json.at("status").get<std::string>();
    record.reason = json.at("reason").get<std::string>();
    for (const Json& entry : json.at("methods")) {
      SweepRecord::Method method{entry.at("name").get<std::string>(),
                                 entry.at("method").get<std::string>(),
                                 entry.at("scheme").get<std::string>(),
                                 entry.at("status").get<std::string>(),
                                 {}};
      for (const MetricField& field : metric_fields()) {
        if (const auto found = entry.at("metrics").find(field.name); found != entry.at("metrics").end()) {
          method.metrics.*field.value = json_number(*found);  // an older record lacks the newer ones
        }
      }
      if (const auto found = entry.find("over_motion"); found != entry.end()) {
        for (const auto& [name, value] : found->items()) {
          method.over_motion.emplace_back(name, json_number(value));
        }
      }
      record.methods.push_back(std::move(method));
    }
    record.judged_skin = json.value("judged_skin", "");  // which an older record lacks
    record.faces = json.at("faces").get<int>();
    record.channels = json.at("channels").get<int>();
    record.seconds = json_number(json.at("seconds"));
    record.peak_mib = json_number(json.at("peak_mib"));
    record.models = json.at("models").get<int>();
    record.models_reused = json.at("models_reused").get<int>();
    record.warnings = json.at("warnings").get<std::vector<std::string>>();
    record.revision = json.at("revision").get<std::string>();
    for (const auto& [name, file] : json.at("files").items()) {
      record.files.push_back({name, file.at("bytes").get<std::uintmax_t>(), file.at("crc32").get<std::string>()});
    }
    return record;
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("{}: not the record of a case: {}", path, error.what()));
  }
}

std::vector<SweepColumn> sweep_columns(const SweepSummary& summary) {
  const std::vector<SweepRow> rows = sweep_rows(summary);
  std::vector<SweepColumn> columns;
  for (const Column& column : columns_of(summary)) {
    columns.push_back(filled(column, rows));
  }
  return columns;
}

void write_sweep_csv(const std::string& path, const SweepSummary& summary) {
  const std::vector<Column> columns = columns_of(summary);
  std::vector<std::string> line;
  std::ranges::transform(columns, std::back_inserter(line), &Column::name);
  std::string text = csv_line(line);
  for (const SweepRow& row : sweep_rows(summary)) {
    std::ranges::transform(columns, line.begin(), [&](const Column& column) { return csv_cell(column, row); });
    text += csv_line(line);
  }
  write_text_file(path, text);
}

void write_sweep_h5(const std::string& path, const SweepSummary& summary) {
  const hdf5::MemoryFile file(path);
  {
    const hdf5::Group root = file.root();
    root.set_attribute("format", "touchfield-sweep");
    root.set_attribute("format_version", 1);
    root.set_attribute("name", summary.name);
    root.set_attribute("plan_hash", summary.hash);
    root.set_attribute("cases", summary.cases);
    root.set_attribute("cases_done", static_cast<int>(summary.records.size()));
    root.write_text("sweep", summary.text);
    root.write_text("base", summary.base);
    provenance_parts(GroupWriter(root.create("provenance")), summary.provenance);
    const std::vector<SweepRow> rows = sweep_rows(summary);
    if (!rows.empty()) {
      const hdf5::Group inputs = root.create(kInputs);
      const hdf5::Group metrics = root.create("metrics");
      std::optional<hdf5::Group> motion;
      for (const Column& column : columns_of(summary)) {
        if (column.group == kMotion && !motion) {
          motion.emplace(root.create(kMotion));
        }
        write_column(column.group.empty()      ? root
                     : column.group == kInputs ? inputs
                     : column.group == kMotion ? *motion
                                               : metrics,
                     filled(column, rows));
      }
    }
  }
  write_archive(path, file);
}

std::string parts_text(const SweepSummary& summary) {
  const auto parts = std::ranges::count(summary.records, to_string(SkinExtent::kPart), &SweepRecord::judged_skin);
  return parts == 0 ? "" : fmt::format("{} case{} {}.", parts, parts == 1 ? "" : "s", extent_label(SkinExtent::kPart));
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
  for (const char* name : {"method", "error", "width [mm]", "leakage", "force [mN]", "seconds", "status"}) {
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
    line.push_back(table_number(metrics.width_mm, "{:.2f}"));
    line.push_back(table_number(100.0 * metrics.leakage, "{:.2f} %"));
    line.push_back(table_number(1e3 * metrics.force_target_n, "{:.3g}"));
    line.push_back(table_number(row.record->seconds, "{:.1f}"));
    line.push_back(row.record->status == "ok" ? row.method != nullptr ? row.method->status : "ok" : "FAILED");
    lines.push_back(std::move(line));
  }
  const std::string parts = parts_text(summary);
  return (parts.empty() ? "" : parts + '\n') + aligned_table(lines);
}

}  // namespace touchfield
