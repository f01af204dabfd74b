#include "apps/commands/mesh_text.h"

#include <fmt/format.h>

#include "apps/commands/run_json.h"
#include "sim/acoustics/medium.h"
#include "sim/core/counted.h"
#include "sim/core/place_text.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

/// In air at 20 C at 40 kHz [m].
double usual_wavelength() { return Wave(air(kZeroCelsius + 20.0), 40e3).wavelength(); }

bool has_faces(const SkinReport& skin) { return skin.mean_edge > 0; }

std::string skin_lines(const SkinReport& skin) {
  if (!has_faces(skin)) {
    return {};
  }
  const MeshReport& mesh = skin.mesh;
  const double wavelength = usual_wavelength();
  std::string text = fmt::format("  surface     {:.1f} cm2, {}, {}{}\n", mesh.area * 1e4,
                                 mesh.closed() ? fmt::format("{:.1f} cm3", mesh.volume * 1e6) : "open",
                                 counted(mesh.components, "piece", "pieces"),
                                 mesh.nested_pieces > 0 ? fmt::format(" ({} inside another)", mesh.nested_pieces) : "");
  for (const Hole& hole : mesh.holes) {
    constexpr std::ptrdiff_t kMostShown = 5;
    const std::ptrdiff_t number = &hole - mesh.holes.data();
    if (number == kMostShown) {
      text += fmt::format("  hole        {} more\n", mesh.holes.size() - kMostShown);
      break;
    }
    text += fmt::format("  hole        {} edges, {:.2f} mm round, near {}\n", hole.edges, hole.length / kMillimetre,
                        place_text(hole.at, 2));
  }
  text += fmt::format("  edges       {:.3g} to {:.3g} mm, mean {:.3g} mm; smallest angle {:.2g} degrees\n",
                      mesh.shortest_edge / kMillimetre, mesh.longest_edge / kMillimetre, skin.mean_edge / kMillimetre,
                      mesh.smallest_angle / kDegree);
  text += fmt::format("  resolution  {:.2f} edges per wavelength ({:.2f} mm at 40 kHz), {:.2f} at the longest edge\n",
                      wavelength / skin.mean_edge, wavelength / kMillimetre, wavelength / mesh.longest_edge);
  return text;
}

nlohmann::ordered_json skin_json(const SkinReport& skin) {
  const MeshReport& mesh = skin.mesh;
  nlohmann::ordered_json holes = nlohmann::ordered_json::array();
  for (const Hole& hole : mesh.holes) {
    holes.push_back({{"edges", hole.edges},
                     {"length_mm", hole.length / kMillimetre},
                     {"at_mm", {hole.at.x() / kMillimetre, hole.at.y() / kMillimetre, hole.at.z() / kMillimetre}}});
  }
  const double wavelength = usual_wavelength();
  return {{"faces", mesh.faces},
          {"vertices", mesh.vertices},
          {"components", mesh.components},
          {"nested_pieces", mesh.nested_pieces},
          {"closed", has_faces(skin) && mesh.closed()},
          {"inside_out", mesh.inside_out},
          {"boundary_edges", mesh.boundary_edges},
          {"holes", holes},
          {"nonmanifold_edges", mesh.nonmanifold_edges},
          {"nonmanifold_vertices", mesh.nonmanifold_vertices},
          {"misoriented_edges", mesh.misoriented_edges},
          {"flat_faces", skin.flat_faces},
          {"self_intersections", skin.crossings},
          {"area_cm2", mesh.area * 1e4},
          {"volume_cm3", mesh.volume * 1e6},
          {"shortest_edge_mm", mesh.shortest_edge / kMillimetre},
          {"longest_edge_mm", mesh.longest_edge / kMillimetre},
          {"mean_edge_mm", skin.mean_edge / kMillimetre},
          {"smallest_angle_deg", mesh.smallest_angle / kDegree},
          {"epw_mean", number_or_null(wavelength / skin.mean_edge)},
          {"epw_min", number_or_null(wavelength / mesh.longest_edge)},
          {"faults", skin.faults}};
}

nlohmann::ordered_json distance_json(const std::optional<SurfaceDistance>& distance) {
  if (!distance) {
    return nullptr;
  }
  return {{"share_counted", distance->counted},
          {"most_95_mm", distance->most_of_it / kMillimetre},
          {"farthest_mm", distance->farthest / kMillimetre}};
}

/// How sure a guess is: a word, and as a report says it.
std::pair<const char*, const char*> certainty_words(UnitCertainty certainty) {
  switch (certainty) {
    case UnitCertainty::kSure:
      return {"sure", "surely"};
    case UnitCertainty::kLikely:
      return {"likely", "likely if it is a hand, but another unit makes it a smaller or larger body"};
    case UnitCertainty::kUnclear:
      return {"unclear", "but no unit makes it as large as a hand"};
    case UnitCertainty::kNone:
      break;
  }
  return {"none", "but no unit makes it a hand, a finger or an arm"};
}

}  // namespace

const char* certainty_text(UnitCertainty certainty) { return certainty_words(certainty).second; }

std::string describe_mesh(const MeshText& text) {
  const SurfaceReport& report = text.report;
  std::string lines = fmt::format("{}: {}, {}\n", text.file, counted(report.faces, "face", "faces"),
                                  counted(report.points, "point", "points"));
  lines += fmt::format("  unit        {}, {}; {:.4g} {} across\n", text.unit.name,
                       text.unit_stated ? "as stated" : "guessed", text.size, text.unit.name);
  if (report.repeated_points > 0 || report.unreferenced_points > 0) {
    lines += fmt::format("  points      {} duplicates, {} not used by any face\n", report.repeated_points,
                         report.unreferenced_points);
  }
  lines += skin_lines(report.skin);
  if (report.skin.faults.empty()) {
    lines += "  faults      none: the mesh can be used as a scatterer\n";
  }
  for (const std::string& fault : report.skin.faults) {
    lines += fmt::format("  fault       {}\n", fault);
  }
  for (const std::string& step : text.steps) {
    lines += fmt::format("  done        {}\n", step);
  }
  if (text.result) {
    lines += fmt::format("result: {}, {}\n{}", counted(text.result->mesh.faces, "face", "faces"),
                         counted(text.result->mesh.vertices, "point", "points"), skin_lines(*text.result));
  }
  if (!text.written.empty()) {
    lines += fmt::format("written: {}\n", text.written);
  }
  return lines;
}

nlohmann::ordered_json mesh_json(const MeshText& text) {
  const SurfaceReport& report = text.report;
  nlohmann::ordered_json json = {
      {"file", text.file},
      {"unit", text.unit.name},
      {"unit_stated", text.unit_stated},
      {"unit_guess",
       {{"unit", text.guess.unit.name},
        {"certainty", certainty_words(text.guess.certainty).first},
        {"reason", text.guess.reason}}},
      {"size", text.size},
      {"points", report.points},
      {"faces", report.faces},
      {"repeated_points", report.repeated_points},
      {"unreferenced_points", report.unreferenced_points},
      {"collapsed_faces", report.collapsed_faces},
      {"duplicate_faces", report.duplicate_faces},
      {"surface", skin_json(report.skin)},
      {"usable", report.skin.faults.empty()},
      {"warnings", text.warnings},
      {"steps", text.steps},
      {"to_resurfaced", distance_json(text.to_resurfaced)},
      {"from_resurfaced", distance_json(text.from_resurfaced)},
      {"result", text.result ? skin_json(*text.result) : nlohmann::ordered_json(nullptr)},
      {"written", text.written.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(text.written)}};
  return json;
}

}  // namespace touchfield
