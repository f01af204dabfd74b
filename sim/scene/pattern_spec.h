#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/core/types.h"

namespace touchfield {

/// A landmark, or a point of the world [m].
using PatternPlace = std::variant<std::string, Vector3>;

/// Round a place, in the plane that touches the skin there, from the world's +x on.
struct CirclePath {
  PatternPlace at;
  double radius = 3e-3;  // [m]
  double hz = 100;       // turns per second
};
/// There and back at constant speed.
struct LinePath {
  PatternPlace from;
  PatternPlace to;
  double hz = 100;
};
/// One place after another, each for the same time.
struct PointsPath {
  std::vector<PatternPlace> at;
  double hz = 100;  // times per second that each is visited
};

/// A pattern that repeats on a still hand: a spot that moves, or the scene's own target, and its strength over time.
struct PatternSpec {
  /// Pressure times 1 - depth (1 - cos(2 pi hz t)) / 2.
  struct Amplitude {
    double hz = 200;
    double depth = 1;
  };

  std::variant<std::monostate, CirclePath, LinePath, PointsPath> path;  // none: the target's boxes
  std::optional<Amplitude> amplitude;
  double diameter = 4e-3;           // of the spot [m]
  double frames_hz = 1000;          // [1/s]
  std::optional<double> seconds;    // absent: the shortest time after which all of it repeats
  std::optional<double> most_turn;  // of a channel's phase from frame to frame [rad]
  int iterations = 24;              // of each frame after the first
  std::optional<double> pressure;   // [Pa]; absent: the target's
  std::vector<std::string> watch;   // landmarks
  std::optional<double> ring_up;    // time constant of the transducers [s]
};

}  // namespace touchfield
