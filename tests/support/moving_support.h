#pragma once

#include <string>

namespace touchfield {
inline namespace testing {

/// A capsule 80 mm above a small array, which moves across it at 50 mm/s for 0.3 s. Nothing is predicted.
inline const std::string kMovingCapsule =
    "name: moving\n"
    "array: {grid: {count: [12, 10], pitch_mm: 10.16}}\n"
    "body:\n"
    "  capsule: {radius_mm: 7, length_mm: 12}\n"
    "  place: {landmark: bottom, at_mm: [0, 0, 80]}\n"
    "  edge_mm: 2.5\n"
    "target: {box: {at: bottom, size_mm: [5, 6, 6]}, pressure_pa: 2500}\n"
    "solve: {methods: [surface, {paper: {faces: area}}, {unscattered: {faces: area}}], scheme: chief}\n"
    "evaluation: same\n"
    "motion: {seconds: 0.3, solve_ms: 20, predict: none, change: [{path: 'body.place.at_mm[0]', rate: 50}]}\n";

}  // namespace testing
}  // namespace touchfield
