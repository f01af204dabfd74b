#include "sim/store/study_files.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "sim/bem/scheme.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

bool has_both(const StudyRung& rung) { return std::isfinite(rung.seconds) && std::isfinite(rung.error_reference); }

/// True if `a` is at least as good as `b` in both and better in one.
bool beats(const StudyRung& a, const StudyRung& b) {
  return a.seconds <= b.seconds && a.error_reference <= b.error_reference &&
         (a.seconds < b.seconds || a.error_reference < b.error_reference);
}

/// Number of the rung with the least key among those that are allowed; the first of equals.
std::optional<std::size_t> least(const std::vector<StudyRung>& rungs,
                                 const std::function<bool(const StudyRung&)>& allowed,
                                 const std::function<std::pair<double, double>(const StudyRung&)>& key) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < rungs.size(); ++i) {
    if (has_both(rungs[i]) && allowed(rungs[i]) && (!best || key(rungs[i]) < key(rungs[*best]))) {
      best = i;
    }
  }
  return best;
}

}  // namespace

std::size_t scheme_rank(const std::string& scheme) {
  const auto& all = all_schemes();
  const auto at = std::ranges::find(all, scheme, [](Scheme known) { return to_string(known); });
  return static_cast<std::size_t>(at - all.begin());
}

void mark_pareto(std::vector<StudyRung>& rungs) {
  for (StudyRung& rung : rungs) {
    rung.pareto = has_both(rung) && std::ranges::none_of(rungs, [&](const StudyRung& other) {
                    return has_both(other) && beats(other, rung);
                  });
  }
}

std::optional<std::size_t> pick_within_seconds(const std::vector<StudyRung>& rungs, double budget) {
  return least(
      rungs, [&](const StudyRung& rung) { return rung.seconds <= budget; },
      [](const StudyRung& rung) { return std::pair(rung.error_reference, rung.seconds); });
}

std::optional<std::size_t> pick_within_error(const std::vector<StudyRung>& rungs, double error) {
  return least(
      rungs, [&](const StudyRung& rung) { return rung.error_reference <= error; },
      [](const StudyRung& rung) { return std::pair(rung.seconds, rung.error_reference); });
}

void write_study_csv(const std::string& path, const std::vector<StudyRung>& rungs) {
  std::string text = csv_line({"scheme", "edge_mm", "faces", "precision", "solver", "seconds", "peak_mib",
                               "error_reference", "error_interior", "pattern_error", "pareto", "status"});
  for (const StudyRung& rung : rungs) {
    text += csv_line({rung.scheme, csv_number(rung.edge_mm), fmt::format("{}", rung.faces), rung.precision, rung.solver,
                      csv_number(rung.seconds), csv_number(rung.peak_mib), csv_number(rung.error_reference),
                      csv_number(rung.error_interior), csv_number(rung.pattern_error), rung.pareto ? "1" : "0",
                      rung.status});
  }
  write_text_file(path, text);
}

std::string study_table(const std::vector<StudyRung>& rungs) {
  std::vector<std::vector<std::string>> rows = {{"  scheme", "edge [mm]", "faces", "precision", "solver", "seconds",
                                                 "peak [MiB]", "error", "interior", "pattern", "status"}};
  std::vector<StudyRung> sorted = rungs;
  std::ranges::stable_sort(sorted, {}, [](const StudyRung& rung) {
    return std::tuple(scheme_rank(rung.scheme), rung.scheme, std::isnan(rung.edge_mm) ? HUGE_VAL : rung.edge_mm);
  });
  const auto percent = [](double fraction) { return table_number(100.0 * fraction, "{:.3g} %"); };
  for (const StudyRung& rung : sorted) {
    rows.push_back({(rung.pareto ? "* " : "  ") + rung.scheme, table_number(rung.edge_mm, "{:.3g}"),
                    rung.faces > 0 ? grouped(rung.faces) : "-", rung.precision, rung.solver,
                    table_number(rung.seconds, "{:.3g}"), table_number(rung.peak_mib, "{:.0f}"),
                    percent(rung.error_reference), percent(rung.error_interior), percent(rung.pattern_error),
                    rung.status});
  }
  constexpr std::size_t kPrecision = 3;
  constexpr std::size_t kSolver = 4;
  constexpr std::size_t kStatus = 10;
  return aligned_table(rows, {kPrecision, kSolver, kStatus}) + "  * no other is both faster and more accurate\n";
}

}  // namespace touchfield
