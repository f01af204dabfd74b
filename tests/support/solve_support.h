#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/model/model.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {
inline namespace support {

/// A capsule of a few hundred faces over an array of 64 channels, with a strip as target: everything takes
/// milliseconds.
inline Scene small_scene(const std::vector<std::string>& changes = {}) {
  return read_scene_text(
      "name: small\n"
      "array:\n"
      "  grid: {count: [8, 8], pitch_mm: 10.16}\n"
      "body:\n"
      "  capsule: {radius_mm: 6, length_mm: 10}\n"
      "  place: {landmark: bottom, at_mm: [0, 0, 50]}\n"
      "  edge_mm: 2.5\n"
      "target:\n"
      "  box: {at: bottom, size_mm: [6, 12, 5]}\n"
      "solve:\n"
      "  methods: [paper, unscattered, focus]\n"
      "  iterations: 5\n",
      "small.yaml", "", changes);
}

/// Gives a model a const part of its own, to be changed.
inline FixedModel& own_part(Model& model) {
  const auto own = std::make_shared<FixedModel>(*model.fixed);
  model.fixed = own;
  return *own;
}

inline Model small_model(const std::vector<std::string>& changes = {}) { return build_model(small_scene(changes)); }

}  // namespace support
}  // namespace touchfield
