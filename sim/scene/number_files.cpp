#include "sim/scene/number_files.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/whole_file.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema.h"
#include "sim/scene/text_file.h"

namespace touchfield::schema {

namespace {

constexpr int kMilliPower = -3;

/// Lines of a text without comments and end marks, with their numbers from 1.
template <class Visit>
void for_each_line(std::string_view text, const Visit& visit) {
  for (int number = 1; !text.empty(); ++number) {
    const auto end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (!line.empty() && line.back() == '\r') {
      line.remove_suffix(1);
    }
    visit(number, line.substr(0, line.find('#')));
  }
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

// Parts between single commas.
std::vector<std::string_view> cells(std::string_view line) {
  std::vector<std::string_view> parts;
  for (const auto part : std::views::split(line, ',')) {
    parts.push_back(trimmed({part.begin(), part.end()}));
  }
  return parts;
}

// Parts between commas and white space of any length.
std::vector<std::string_view> words(std::string_view line) {
  constexpr const char* kBetween = ", \t";
  std::vector<std::string_view> parts;
  for (auto first = line.find_first_not_of(kBetween); first != std::string_view::npos;) {
    const auto end = std::min(line.find_first_of(kBetween, first), line.size());
    parts.push_back(line.substr(first, end - first));
    first = line.find_first_not_of(kBetween, end);
  }
  return parts;
}

/// Reports what is wrong with a file; stops after a few lines, since the rest is usually wrong in the same way.
class FileReport {
 public:
  FileReport(const Input& in, const std::string& path) : in_(in), path_(path) {}

  bool failed() const { return count_ > 0; }
  bool full() const { return count_ >= kMost; }
  void add(int line, const std::string& text) { report(fmt::format("{}:{}: {}", path_, line, text)); }
  void add(const std::string& text) { report(fmt::format("{}: {}", path_, text)); }

  void require_few(std::size_t count, const char* what) {
    if (count > kMostListed) {
      add(fmt::format("{} {}, must be at most {}", count, what, kMostListed));
    }
  }

  /// A number within the bounds every number of a scene has; reports and returns nothing otherwise.
  std::optional<double> number(int line, std::string_view text, int power = 0) {
    const auto value = parse_decimal(text);
    const auto rule = value ? Range{}.broken_by(*value) : std::optional<std::string>("a number");
    if (!rule) {
      return parse_decimal(text, power);
    }
    add(line, fmt::format("{} must be {}", text.empty() ? "no value" : quoted_for_message(std::string(text)), *rule));
    return std::nullopt;
  }

 private:
  static constexpr int kMost = 10;

  void report(const std::string& text) {
    in_.reading().add_elsewhere(in_.node().place, text);
    ++count_;
  }

  const Input& in_;
  const std::string& path_;
  int count_ = 0;
};

std::optional<std::string> load(const Input& in, const std::string& path) {
  try {
    std::string text = read_whole_file(path, kMostTextBytes);
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (text.starts_with(kByteOrderMark)) {
      text.erase(0, kByteOrderMark.size());
    }
    return text;
  } catch (const InputError& error) {
    in.problem(error.what());
    return std::nullopt;
  }
}

bool looks_like_header(const std::vector<std::string_view>& parts) {
  return std::ranges::none_of(parts, [](std::string_view part) { return part.empty() || parse_decimal(part); });
}

}  // namespace

std::optional<std::vector<double>> read_phases(const Input& in, const std::string& path) {
  const auto text = load(in, path);
  if (!text) {
    return std::nullopt;
  }
  FileReport report(in, path);
  std::vector<double> phases;
  for_each_line(*text, [&](int number, std::string_view line) {
    for (const auto part : words(line)) {
      if (report.full()) {
        return;
      }
      if (const auto value = report.number(number, part)) {
        phases.push_back(*value);
      }
    }
  });
  if (!report.failed() && phases.empty()) {
    report.add("no number in it, must hold at least one phase");
  }
  report.require_few(phases.size(), "phases");
  if (report.failed()) {
    return std::nullopt;
  }
  return phases;
}

std::optional<PositionsFile> read_positions(const Input& in, const std::string& path) {
  const auto text = load(in, path);
  if (!text) {
    return std::nullopt;
  }
  FileReport report(in, path);
  std::vector<double> values;
  std::size_t columns = 0;
  bool first = true;
  for_each_line(*text, [&](int number, std::string_view line) {
    if (trimmed(line).empty() || report.full()) {
      return;
    }
    const auto parts = cells(line);
    const bool header = first && looks_like_header(parts);
    first = false;
    if (header) {
      return;
    }
    if (parts.size() != 3 && parts.size() != 6) {
      report.add(number, fmt::format("{} value{}, must be 3 or 6", parts.size(), parts.size() == 1 ? "" : "s"));
      return;
    }
    if (columns == 0) {
      columns = parts.size();
    }
    if (parts.size() != columns) {
      report.add(number, fmt::format("{} values, must be {} as in the first line", parts.size(), columns));
      return;
    }
    bool zero_axis = columns == 6;
    for (std::size_t i = 0; i < columns; ++i) {
      const auto value = report.number(number, parts[i], i < 3 ? kMilliPower : 0);
      if (value) {
        values.push_back(*value);
      }
      if (i >= 3 && value != 0.0) {
        zero_axis = false;
      }
    }
    if (zero_axis) {
      report.add(number, "the axis must not be zero");
    }
  });
  if (!report.failed() && columns == 0) {
    report.add("no position in it, must hold at least one");
  }
  report.require_few(columns == 0 ? 0 : values.size() / columns, "positions");
  if (report.failed() || columns == 0) {
    return std::nullopt;
  }

  const auto rows = static_cast<Eigen::Index>(values.size() / columns);
  const Eigen::Map<const Eigen::MatrixXd> table(values.data(), static_cast<Eigen::Index>(columns), rows);
  PositionsFile file;
  file.points = table.topRows(3);
  if (columns == 6) {
    file.axes = table.bottomRows(3);
  }
  return file;
}

}  // namespace touchfield::schema
