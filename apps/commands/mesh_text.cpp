#include "apps/commands/mesh_text.h"

#include "sim/acoustics/medium.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

/// In air at 20 C at 40 kHz [m].
double usual_wavelength() { return Wave(air(kZeroCelsius + 20.0), 40e3).wavelength(); }

bool has_faces(const SkinReport& skin) { return skin.mean_edge > 0; }

Json skin_value(const SkinReport& skin) {
  const MeshReport& mesh = skin.mesh;
  Json holes = Json::array();
  for (const Hole& hole : mesh.holes) {
    const Vector3 at = hole.at / kMillimetre;
    holes.push_back(Json{{"edges", hole.edges},
                         {"length_mm", hole.length / kMillimetre},
                         {"at_mm", std::vector<double>(at.begin(), at.end())}});
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
          {"wavelength_mm", wavelength / kMillimetre},
          {"epw_mean", wavelength / skin.mean_edge},
          {"epw_min", wavelength / mesh.longest_edge},
          {"faults", skin.faults}};
}

Json distance_value(const std::optional<SurfaceDistance>& distance) {
  return distance ? Json{{"share_counted", distance->counted},
                         {"most_95_mm", distance->most_of_it / kMillimetre},
                         {"farthest_mm", distance->farthest / kMillimetre}}
                  : Json();
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

Json mesh_value(const MeshText& text) {
  const SurfaceReport& report = text.report;
  return {{"file", text.file},
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
          {"surface", skin_value(report.skin)},
          {"usable", report.skin.faults.empty()},
          {"warnings", text.warnings},
          {"steps", text.steps},
          {"to_resurfaced", distance_value(text.to_resurfaced)},
          {"from_resurfaced", distance_value(text.from_resurfaced)},
          {"result", text.result ? skin_value(*text.result) : Json()},
          {"written", text.written.empty() ? Json() : Json(text.written)}};
}

}  // namespace touchfield
