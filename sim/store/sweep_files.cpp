#include "sim/store/sweep_files.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <variant>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/json_text.h"
#include "sim/core/text_number.h"
#include "sim/store/checksum.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kRecordChecksum = "crc32";  // of the rest of the record, as one line

Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double json_number(const Json& json) { return json.is_null() ? kNotComputed : json.get<double>(); }

std::string sweep_cell(const std::string& text) { return text; }
std::string sweep_cell(double number) { return csv_number(number); }
std::string sweep_cell(std::int64_t count) { return fmt::format("{}", count); }

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
    record.judged_skin = json.at("judged_skin").get<std::string>();
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
  const auto add = [&](const std::string& name, const auto& value) {
    std::vector<decltype(value(rows.front()))> values;
    values.reserve(rows.size());
    std::ranges::transform(rows, std::back_inserter(values), value);
    columns.push_back({name, std::move(values)});
  };
  const auto add_count = [&](const std::string& name, int SweepRecord::*member) {
    add(name, [=](const SweepRow& row) { return static_cast<std::int64_t>(row.record->*member); });
  };
  const auto add_number = [&](const std::string& name, double SweepRecord::*member) {
    add(name, [=](const SweepRow& row) { return row.record->*member; });
  };
  const auto add_text = [&](const std::string& name, std::string SweepRecord::*member) {
    add(name, [=](const SweepRow& row) { return row.record->*member; });
  };
  const auto add_text_of_method = [&](const std::string& name, std::string SweepRecord::Method::*member) {
    add(name, [=](const SweepRow& row) { return row.method != nullptr ? row.method->*member : std::string(); });
  };
  add_count("case", &SweepRecord::number);
  add_text("status", &SweepRecord::status);
  for (const std::string& path : summary.parameters) {
    add(path, [&](const SweepRow& row) { return input_of(*row.record, path).value_or(""); });
  }
  add_text_of_method("name", &SweepRecord::Method::name);
  add_text_of_method("method", &SweepRecord::Method::method);
  add_text_of_method("scheme", &SweepRecord::Method::scheme);
  add_text("judged_skin", &SweepRecord::judged_skin);
  for (const MetricField& field : metric_fields()) {
    add(field.name,
        [&](const SweepRow& row) { return row.method != nullptr ? row.method->metrics.*field.value : kNotComputed; });
  }
  for (const std::string& name : motion_columns(summary)) {
    add(name,
        [&](const SweepRow& row) { return row.method != nullptr ? over_motion(*row.method, name) : kNotComputed; });
  }
  add_text_of_method("method_status", &SweepRecord::Method::status);
  add_count("faces", &SweepRecord::faces);
  add_count("channels", &SweepRecord::channels);
  add_number("seconds", &SweepRecord::seconds);
  add_number("peak_mib", &SweepRecord::peak_mib);
  add_count("models", &SweepRecord::models);
  add_count("models_reused", &SweepRecord::models_reused);
  add_text("revision", &SweepRecord::revision);
  add_text("reason", &SweepRecord::reason);
  return columns;
}

void write_sweep_csv(const std::string& path, const SweepSummary& summary) {
  const std::vector<SweepColumn> columns = sweep_columns(summary);
  std::vector<std::string> line;
  std::ranges::transform(columns, std::back_inserter(line), &SweepColumn::name);
  std::string text = csv_line(line);
  const std::size_t rows = sweep_rows(summary).size();
  for (std::size_t row = 0; row < rows; ++row) {
    std::ranges::transform(columns, line.begin(), [row](const SweepColumn& column) {
      return std::visit([row](const auto& values) { return sweep_cell(values[row]); }, column.values);
    });
    text += csv_line(line);
  }
  write_text_file(path, text);
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
