#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/units.h"
#include "sim/mesh/io/mesh_io.h"
#include "sim/mesh/query/inspect.h"

namespace touchfield {

int hand_command(const HandCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  require_free_output(command.output, command.force);
  const Body body = hand(command.options);
  write_mesh(command.output, body.mesh, command.unit);
  const MeshReport report = inspect(body.mesh);
  nlohmann::ordered_json landmarks = nlohmann::ordered_json::object();
  for (const Landmark& landmark : body.landmarks) {
    const Vector3 at = position(body.mesh, landmark) / command.unit;
    landmarks[landmark.name] = {at.x(), at.y(), at.z()};
  }
  if (flags.json) {
    const nlohmann::ordered_json json = {{"file", command.output},
                                         {"faces", report.faces},
                                         {"area_cm2", report.area * 1e4},
                                         {"volume_cm3", report.volume * 1e6},
                                         {"landmarks", landmarks}};
    put(fmt::format("{}\n", json.dump(2)));
  } else if (!flags.quiet) {
    put(fmt::format("{}: {} faces, {:.1f} cm2, {:.1f} cm3, edges {:.2f} to {:.2f} mm\n", command.output, report.faces,
                    report.area * 1e4, report.volume * 1e6, report.shortest_edge / kMillimetre,
                    report.longest_edge / kMillimetre));
    put("landmarks in the file's unit:\n");
    for (const auto& [name, at] : landmarks.items()) {
      put(fmt::format("  {:<12} {:9.3f} {:9.3f} {:9.3f}\n", name, at[0].get<double>(), at[1].get<double>(),
                      at[2].get<double>()));
    }
  }
  return 0;
}

}  // namespace touchfield
