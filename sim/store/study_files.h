#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/json.h"
#include "sim/field/metrics.h"

namespace touchfield {

/// One way to solve a scene, and what it costs and gives. A number that was not computed is NaN.
struct StudyRung {
  std::string scheme;
  double edge_mm = kNotComputed;  // body.edge_mm; of a mesh from a file its mean edge
  long faces = 0;
  std::string precision;
  std::string solver;
  double seconds = kNotComputed;
  double peak_mib = kNotComputed;         // largest memory [MiB]
  double error_reference = kNotComputed;  // relative, against the reference solution
  double error_interior = kNotComputed;   // relative, rms of the interior-source indicator
  double pattern_error = kNotComputed;    // relative, after the best scale
  bool pareto = false;                    // no rung is both as fast and as exact, and better in one: mark_pareto
  std::string status = "ok";              // or why it has no numbers
};

/// Place of a scheme among all_schemes(); behind them for any other name.
std::size_t scheme_rank(const std::string& scheme);

/// Sets `pareto` of every rung: true if no other has at most its error_reference in at most its seconds, one of the two
/// smaller. A rung without both numbers is never marked.
void mark_pareto(std::vector<StudyRung>& rungs);

/// The rung of the least error_reference among those that take at most `budget` seconds; the fastest of equals.
std::optional<std::size_t> pick_within_seconds(const std::vector<StudyRung>& rungs, double budget);

/// The fastest rung among those with an error_reference of at most `error`; the most exact of equals.
std::optional<std::size_t> pick_within_error(const std::vector<StudyRung>& rungs, double error);

/// A rung by the names of study.csv's columns; and all of them.
Json rung_value(const StudyRung& rung);
Json rung_values(const std::vector<StudyRung>& rungs);

/// study.csv: a header line and a line a rung: scheme, edge_mm, faces, precision, solver, seconds, peak_mib,
/// error_reference, error_interior, pattern_error, pareto (1 or 0), status. Whole or not at all.
///
/// throws   IoError naming the path and the system's reason
void write_study_csv(const std::string& path, const std::vector<StudyRung>& rungs);

/// The rungs as a table for a person, by scheme, the cheapest first, then by edge.
std::string study_table(const std::vector<StudyRung>& rungs);

}  // namespace touchfield
