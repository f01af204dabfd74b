#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/field/held_signal.h"
#include "sim/motion/pattern_path.h"
#include "sim/run/motion_data.h"

namespace touchfield {

/// What a frame does besides the metrics of its score.
struct PatternFrame {
  double level = 0;                   // amplitude of the channels
  double turn = 0;                    // largest change of a phase since the frame before, of the first since the last
  double ring_error = kNotComputed;   // relative_error in the middle of the frame with transducers that ring up
  double alone_error = kNotComputed;  // of the frame solved by itself
  double alone_seconds = kNotComputed;
};

/// The sound at a place over one pass. Radiation pressure is |p|^2 / (4 rho c^2), without flow along the skin.
struct PatternSound {
  PatternPoint point;
  Eigen::VectorXd pressure;         // |p|, F [Pa]
  Eigen::VectorXd radiation;        // F [Pa]
  std::vector<SpectralLine> lines;  // of the radiation, to 500 Hz [Pa2]

  double mean_square() const { return 0.5 * pressure.squaredNorm() / static_cast<double>(pressure.size()); }  // [Pa2]
};

/// One pass of a pattern.
struct Pattern {
  PatternClock clock;
  Motion motion;  // one method, `surface`: a frame and a score for each of the pattern's
  std::vector<PatternFrame> frames{};
  std::vector<PatternSound> sounds{};
  std::vector<MotionInstant> instants{};  // of some frames, with the pressure of the whole skin
  Eigen::Index faces = 0;                 // that any frame uses
  Eigen::Index outside_rows = 0;          // of R
  double reduced_off = 0;  // largest difference of relative_error at the instants: all faces against those and R
};

struct PatternOptions {
  std::string command_line;    // kept as provenance
  int threads = 1;             // likewise; the caller has set them
  std::optional<int> check{};  // each of how many frames is solved by itself too
  int instants = 6;            // at most
};

/// Solves the scene's pattern on its still hand. The rows of H of all faces that it uses, and R of the others, are
/// computed once. Then the frames are solved one by one (solve_sequence). The amplitude modulation scales the
/// drive of each frame. Scores are of the solving mesh, by those rows:
///
///   relative_error^2 = 1 - C^2 / (E W),   C = sum_T A |p| p',   W = sum_T A p'^2,   E = sum_U A |p|^2 + |R q|^2 / w_Z
///
/// model    of a scene with a pattern
/// throws   InputError as pattern_spots, or if solve.outside_weight is 0; NumericalError as the solver
Pattern solve_pattern(const Model& model, const PatternOptions& options, Progress& progress);

/// Drives in the middle of each frame of a pattern that repeats, with transducers of the first order:
///
///   e' = (q_k - e) / tau,   the same at the end of a pass as at its beginning
///
/// drives    q, N x F
/// frame     duration of a frame [s]
/// ring_up   tau [s], > 0
Eigen::MatrixXcd rung_up(const Eigen::MatrixXcd& drives, double frame, double ring_up);

}  // namespace touchfield
