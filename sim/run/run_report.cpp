#include "sim/run/run_report.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/run/result_text.h"
#include "sim/run/run_file.h"
#include "sim/run/run_layout.h"
#include "sim/run/text_table.h"
#include "solvers/phase/phase_methods.h"

namespace touchfield {

namespace {

constexpr const char* kStyle =
    "body{font:16px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1b1b1b}"
    "img{max-width:100%;height:auto;border:1px solid #ddd}"
    "table{border-collapse:collapse;display:block;overflow-x:auto}"
    "td,th{padding:.25rem .7rem;border-bottom:1px solid #ddd;text-align:right}"
    "td:first-child,th:first-child{text-align:left}"
    "pre{background:#f5f5f5;padding:.8rem;overflow-x:auto;white-space:pre-wrap}";

/// Method names stand in results as scenes give them; this is what the program calls what they do.
std::string help_of(const std::string& method) {
  const std::span<const PhaseMethod> all = phase_methods();
  const auto found = std::ranges::find(all, method, &PhaseMethod::name);
  return found == all.end() ? "" : std::string(found->help);
}

std::string array_sentence(const TransducerArray& array) {
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return fmt::format("The sound was a plane wave of {:.4g} Pa. ", array.amplitudes(0));
  }
  return fmt::format("The array: {} transducers (directivity: {}). ", array.size(),
                     directivity_name(array.directivity.kind()));
}

std::string evaluation_sentence(const Run& run) {
  if (run.evaluation_model) {
    return fmt::format(
        "All phases were evaluated by the scheme {} on a separate mesh of {} faces (mean edge {:.2f} mm). ",
        run.evaluation_model->scheme, run.evaluation_model->mesh.face_count(),
        1e3 * run.evaluation_model->mesh.mean_edge());
  }
  return run.evaluation == "none" ? "" : "All phases were evaluated on the mesh that they were found on. ";
}

/// Of one solve per scheme: how its system was solved.
std::string scattering_sentence(const Run& run) {
  std::set<std::string> told;
  std::string text;
  for (const SolveRecord& solve : run.solves) {
    if (told.insert(solve.scheme).second) {
      text += fmt::format(
          "Scattering by the sound-hard skin was computed by boundary elements (scheme {}, {}, largest "
          "relative residual {:.1e}). ",
          solve.scheme, solve.solver, solve.residual);
    }
  }
  return text;
}

std::string cell(const std::string& text, const char* tag = "td") {
  return fmt::format("<{0}>{1}</{0}>", tag, markup_text(text));
}

std::string figures_of(const Run& run) {
  std::string text = "<table><tr>";
  for (const char* head : {"method", "error [%]", "mean in target [Pa]", "width [mm]", "leakage [%]", "force [mN]"}) {
    text += cell(head, "th");
  }
  text += "</tr>\n";
  for (const MethodResult& result : run.methods) {
    const Metrics& metrics = result.metrics;
    text += "<tr>" + cell(result.name) + cell(table_number(1e2 * metrics.relative_error, "{:.1f}")) +
            cell(table_number(metrics.mean_inside_pa, "{:.0f}")) + cell(table_number(metrics.width_mm, "{:.2f}")) +
            cell(table_number(1e2 * metrics.leakage, "{:.0f}")) +
            cell(table_number(1e3 * metrics.force_target_n, "{:.3g}")) + "</tr>\n";
  }
  return text + "</table>\n";
}

std::string list_of(const char* title, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += "<li>" + markup_text(line) + "</li>\n";
  }
  return text.empty() ? "" : fmt::format("<h2>{}</h2>\n<ul>\n{}</ul>\n", title, text);
}

std::string shown(const std::vector<std::string>& pictures) {
  std::string text;
  for (const std::string& picture : pictures) {
    if (picture.ends_with(".pdf")) {
      text += fmt::format("<p><a href=\"{0}\">{0}</a></p>\n", markup_text(picture));
    } else {
      text += fmt::format("<p><img src=\"{0}\" alt=\"{0}\"/></p>\n", markup_text(picture));
    }
  }
  return text;
}

}  // namespace

std::string methods_paragraph(const Run& run) {
  std::string text = fmt::format("The skin was a mesh of {} triangular faces (area {:.0f} cm2, mean edge {:.2f} mm). ",
                                 run.mesh.face_count(), 1e4 * run.mesh.total_area(), 1e3 * run.mesh.mean_edge());
  text += array_sentence(run.array) + scattering_sentence(run);
  if (run.target) {
    text += fmt::format("The target was a pressure of up to {:.4g} Pa on {} faces. ", run.target->amplitudes.maxCoeff(),
                        run.target->size());
  }
  for (const MethodResult& result : run.methods) {
    text += fmt::format("Method {} ({}): {} ", result.name, result.scheme, help_of(result.method));
  }
  return text + evaluation_sentence(run) +
         fmt::format("Computed with touchfield {} ({}).", run.provenance.version, run.provenance.revision);
}

std::string bibtex(const std::string& version) {
  return "@software{touchfield,\n  title = {touchfield},\n  author = {{The touchfield authors}},\n  version = {" +
         version +
         "}\n}\n"
         "@inproceedings{matsubayashi2020rendering,\n"
         "  title = {Rendering Ultrasound Pressure Distribution on Hand Surface in Real-Time},\n"
         "  author = {Matsubayashi, Atsushi and Makino, Yasutoshi and Shinoda, Hiroyuki},\n"
         "  booktitle = {Haptics: Science, Technology, Applications (EuroHaptics 2020)},\n"
         "  year = {2020},\n  doi = {10.1007/978-3-030-58147-3_45}\n}\n";
}

std::string run_report(const Run& run, const std::vector<std::string>& pictures) {
  std::vector<std::string> first;
  std::vector<std::string> others;
  for (const std::string& picture : pictures) {
    (picture.starts_with("overview") ? first : others).push_back(picture);
  }
  const std::string name = markup_text(run.name);
  const std::string levels = levels_text(run);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" "
      "content=\"width=device-width\"/>\n<title>{0}</title>\n<style>{1}</style></head>\n<body>\n"
      "<h1>{0}</h1>\n{2}<h2>Results</h2>\n{3}{10}{4}{5}"
      "<h2>For a methods section</h2>\n<p>{6}</p>\n<h2>To cite</h2>\n<pre>{7}</pre>\n"
      "<h2>All pictures</h2>\n{8}<h2>Provenance</h2>\n<pre>{9}</pre>\n"
      "<p>The scene is in <a href=\"scene.yaml\">scene.yaml</a>, all figures in <a "
      "href=\"metrics.csv\">metrics.csv</a>.</p>\n"
      "</body>\n</html>\n",
      name, kStyle, shown(first), figures_of(run), list_of("Warnings", run.warnings), list_of("Notes", run.notes),
      markup_text(methods_paragraph(run)), markup_text(bibtex(run.provenance.version)), shown(others),
      markup_text(lines_text(provenance_value(run.provenance))),
      levels.empty() ? "" : "<h2>Sound levels</h2>\n<pre>" + markup_text(levels) + "</pre>\n");
}

}  // namespace touchfield
