#include "sim/run/felt_file.h"

#include <fmt/format.h>

#include "sim/run/run_archive.h"

namespace touchfield {

namespace {

/// [row along y, column along x].
void map_part(const GroupWriter& io, const std::string& name, const Eigen::MatrixXd& map, const char* unit) {
  io.write_compact(name, map.data(), {static_cast<std::uint64_t>(map.cols()), static_cast<std::uint64_t>(map.rows())},
                   unit);
}

void skin_part(const GroupWriter& io, const SkinVibration& skin) {
  map_part(io, "displacement", skin.displacement, skin.has_mechanics ? "m" : "Pa");
  map_part(io, "velocity", skin.velocity, skin.has_mechanics ? "m/s" : "Pa/s");
  for (std::size_t d = 0; skin.has_mechanics && d < skin.energy.size(); ++d) {
    map_part(io, fmt::format("energy_{}", kReceptorNames[d]), skin.energy[d], "J/m3");
  }
  for (std::size_t c = 0; c < skin.weighted.size(); ++c) {
    map_part(io, fmt::format("weighted_{}", channel_name(kTouchChannels[c])), skin.weighted[c],
             skin.has_mechanics ? "m" : "Pa");
  }
  io.matrix("spectrum", skin.at_points.transpose(), skin.at_points.rows(), skin.has_mechanics ? "m" : "Pa");
}

}  // namespace

std::string channel_name(TouchChannel channel) { return channel == TouchChannel::kPacinian ? "p" : "ra"; }

void write_felt_file(const std::string& path, const Felt& felt) {
  const hdf5::MemoryFile file(path);
  const GroupWriter io(file.root());
  format_parts(io, kFeltArchive);
  io.attribute("name", felt.name);
  io.write_text("scene", felt.scene);
  io.part("mesh", true, [&](const GroupWriter& part) { mesh_parts(part, felt.mesh); });
  io.part("patch", true, [&](const GroupWriter& part) {
    part.attribute("step", SkinVibration::kStep);
    part.three("middle", felt.patch.middle, "m");
    part.columns("axes", felt.patch.axes, "1");
    part.list("faces", felt.patch.faces, "1");
    part.write("places", felt.patch.places.data(), {static_cast<std::uint64_t>(felt.patch.size()), 2}, "m");
    part.list("areas", felt.patch.areas, "m2");
  });
  io.part("points", true, [&](const GroupWriter& part) {
    part.column("name", felt.points, &FeltPoint::name, "");
    part.rows("at", felt.points, &FeltPoint::at, 3, "m");
    part.rows("place", felt.points, &FeltPoint::place, 2, "m");
  });
  io.part("methods", true, [&](const GroupWriter& methods) {
    methods.parts(
        felt.methods, [](const FeltMethod& method) { return method.name; },
        [&](const GroupWriter& part, const FeltMethod& method) {
          part.attribute("flattening_error", method.flattening);
          part.list("hz", method.lines.hz, "Hz");
          part.list("radiation_rms", Eigen::VectorXd(method.lines.mean_square().cwiseSqrt()), "Pa");
          part.part("skins", true, [&](const GroupWriter& skins) {
            skins.parts(
                method.skins, [](const SkinVibration& skin) { return skin.skin; }, skin_part);
          });
        });
  });
  io.optional_texts("warnings", felt.warnings);
  io.part("provenance", true, [&](const GroupWriter& part) { provenance_parts(part, felt.provenance); });
  write_archive(path, file);
}

}  // namespace touchfield
