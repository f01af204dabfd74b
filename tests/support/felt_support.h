#pragma once

#include "sim/run/felt.h"
#include "tests/support/output_support.h"

namespace touchfield {
inline namespace support {

/// A sheet under round spots of pressure about its middle, with a standard deviation of 2 mm: methods by their names
/// and the largest pressure [Pa], modulated at 200 Hz. The patch lies 1 mm or more within the sheet.
inline Felt made_up_felt(const std::vector<std::pair<std::string, double>>& methods) {
  const TriangleMesh mesh = sheet(27, 27, 1e-3);
  Felt felt{.name = "spots",
            .scene = "name: spots\n",
            .spec = {},
            .mesh = mesh,
            .patch = skin_patch(mesh, 2 * (27 * 13 + 13)),
            .points = {{"middle", Vector3(0, 0, 0.2), Eigen::Vector2d::Zero()}}};
  felt.provenance.scene_hash = "abc";
  for (const auto& [name, largest] : methods) {
    const Eigen::ArrayXd square = felt.patch.places.colwise().squaredNorm().transpose();
    FeltMethod& method = felt.methods.emplace_back(
        FeltMethod{.name = name, .lines = modulated_lines(largest * (-square / 8e-6).exp(), 200)});
    method.skins = skin_vibrations(felt.patch, method.lines, felt_skins(felt.spec), 1832, {Eigen::Vector2d::Zero()});
  }
  return felt;
}

}  // namespace support
}  // namespace touchfield
