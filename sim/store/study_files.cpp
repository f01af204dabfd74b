#include "sim/store/study_files.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

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

Json rung_value(const StudyRung& rung) {
  return {{"scheme", rung.scheme},
          {"edge_mm", rung.edge_mm},
          {"faces", rung.faces},
          {"precision", rung.precision},
          {"solver", rung.solver},
          {"seconds", rung.seconds},
          {"peak_mib", rung.peak_mib},
          {"error_reference", rung.error_reference},
          {"error_interior", rung.error_interior},
          {"pattern_error", rung.pattern_error},
          {"pareto", rung.pareto},
          {"status", rung.status}};
}

Json rung_values(const std::vector<StudyRung>& rungs) {
  Json values = Json::array();
  std::ranges::transform(rungs, std::back_inserter(values), rung_value);
  return values;
}

void write_study_csv(const std::string& path, const std::vector<StudyRung>& rungs) {
  write_text_file(path, csv_text(rung_value({}), rung_values(rungs)));
}

std::string study_table(const std::vector<StudyRung>& rungs) {
  std::vector<StudyRung> sorted = rungs;
  std::ranges::stable_sort(sorted, {}, [](const StudyRung& rung) {
    return std::tuple(scheme_rank(rung.scheme), rung.scheme, std::isnan(rung.edge_mm) ? HUGE_VAL : rung.edge_mm);
  });
  return table_text(rung_values(sorted), sorted.size()) + "  pareto: no other is both faster and more accurate\n";
}

}  // namespace touchfield
