#pragma once

#include <string>
#include <vector>

#include "sim/model/model.h"
#include "sim/scene/pattern_spec.h"

namespace touchfield {

/// The frames of one pass through a pattern.
struct PatternClock {
  int frames = 0;
  double rate = 0;  // [1/s]

  double time(Eigen::Index frame) const { return static_cast<double>(frame) / rate; }  // its beginning [s]
  double seconds() const { return frames / rate; }
};

inline constexpr int kMostPatternFrames = 20'000;

/// Without seconds: the fewest periods of the path after which the amplitude and the frames come out whole too.
///
/// throws   InputError if there is no such time of at most kMostPatternFrames frames, or fewer than 2
PatternClock pattern_clock(const PatternSpec& spec);

/// Share of the largest pressure that is wanted at a time: 1 - depth (1 - cos(2 pi hz t)) / 2, or 1.
double wanted_share(const PatternSpec& spec, double time);

/// What each frame of a pattern wants of the skin at full strength.
struct PatternSpots {
  std::vector<Eigen::Index> faces;   // of all spots and watched places, U, ascending
  Eigen::MatrixXd amplitudes;        // U x F [Pa], 0: silent; F is 1 where the target itself is meant
  std::vector<Eigen::Index> middle;  // which of the faces is nearest to the spot's middle, F
};

/// A place where the pressure over time is of interest: a watched landmark, or one of the pattern itself.
struct PatternPoint {
  std::string name;
  Vector3 at;         // on the skin [m]
  Eigen::Index face;  // of the mesh
};

/// The watched landmarks, then start and, of a circle, the opposite side; both ends of a line; every point; the middle
/// of the target.
std::vector<PatternPoint> pattern_points(const PatternSpec& spec, const Model& model);

/// A spot is a disc of faces about the skin's point nearest to the path. The centroids of its faces are at most half
/// the diameter from that point. Their normals are less than 90 degrees from the skin's normal there.
///
/// points   their faces are among those of the result
/// throws   InputError if a spot holds no face, fewer than kFewestSolved edges per wavelength unless the scene allows
///          it
PatternSpots pattern_spots(const PatternSpec& spec, const PatternClock& clock, const std::vector<PatternPoint>& points,
                           const Model& model);

}  // namespace touchfield
