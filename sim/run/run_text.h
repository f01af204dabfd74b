#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/core/json.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// Text within XML or HTML.
std::string markup_text(const std::string& text);

std::string array_text(const TransducerArray& array);

Json mesh_size(const TriangleMesh& mesh);
Json provenance_value(const Provenance& provenance);
Json stage_values(const std::vector<std::pair<std::string, double>>& stages);

/// What pages say of every result, in HTML: lists of its warnings and notes; what to cite (BibTeX), and its provenance.
std::string remarks_markup(const std::vector<std::string>& warnings, const std::vector<std::string>& notes);
std::string provenance_markup(const Provenance& provenance);

/// What the page of a run says below its view, in HTML: the figures of each method, warnings, notes, provenance and
/// what to cite (BibTeX). A paragraph for the methods section of a paper has all settings that matter.
std::string run_report(const Run& run);

/// The methods side by side, one per line, with the gap to the optimality bound where it was computed. If the metrics
/// are of a part of the body, its label comes first. The wanted pressure and width come last, with the method that the
/// pressure is best for if the scene asked for the best one.
std::string methods_table(const Run& run);

/// levels_value has the sound levels at the fields of one point, one row per point and method. It also has the limits
/// that are published for the frequency, one row per limit. levels_text is both as text, empty without such fields.
Json levels_value(const Run& run);
std::string levels_text(const Run& run);

/// run_value has the name, mesh and array sizes, solutions and provenance of a run, method_values its methods with
/// every metric. describe_run is the former with methods_table, as text for a person.
Json run_value(const Run& run);
Json method_values(const Run& run);
std::string describe_run(const Run& run);

/// metrics.csv: a header line and one line per method: name, method, scheme, every metric, status. NaN is
/// written as "nan". Whole or not at all.
void write_metrics_csv(const std::string& path, const Run& run);

}  // namespace touchfield
