#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sim/core/progress.h"
#include "sim/model/model.h"
#include "sim/run/motion_data.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// Frequencies from `low` up to, not including, `high` [Hz].
struct FrequencyBand {
  double low;
  double high;
};

/// Where receptors of their own respond: about Merkel cells, Meissner and, in two parts, Pacinian corpuscles.
///
/// source   Gescheider, Bolanowski, Hardick, Somatosens. Mot. Res. 18 (2001) 191
inline constexpr FrequencyBand kTouchBands[] = {{5, 15}, {15, 60}, {60, 200}, {200, 500}};

/// A line of the spectrum of a periodic signal, or a bin that holds several.
struct SpectralLine {
  double hz;           // of the line, or where the bin begins
  double mean_square;  // that it adds to the signal's
  double width = 0;    // of the bin, or to the next line [Hz]
};

inline constexpr double kHighestLine = 500;  // of spectra of patterns [Hz]
inline constexpr double kBinsPerHz = 10;     // of spectra whose lines are closer than that

/// The lines of a signal that holds each of its F values for 1/rate and then repeats (held_lines), 1/2 |c_m|^2 at
/// m rate/F, above 0 and up to `highest`. Where they are closer than 1 / kBinsPerHz, those of a bin of that width are
/// added up. Nothing is windowed: the series is exact.
///
/// values    x, F, at least 1
/// rate      [1/s]
/// highest   [Hz]
std::vector<SpectralLine> lines_of_held(const Eigen::VectorXd& values, double rate, double highest);

double mean_square_in(const std::vector<SpectralLine>& lines, const FrequencyBand& band);

/// The frames of one pass through a pattern.
struct PatternClock {
  int frames = 0;
  double rate = 0;  // [1/s]

  double time(Eigen::Index frame) const { return static_cast<double>(frame) / rate; }  // its beginning [s]
  double seconds() const { return frames / rate; }
};

inline constexpr int kMostPatternFrames = 20'000;
inline constexpr double kLongestPattern = 3600;  // [s]

/// Without seconds: the fewest periods of the path after which the amplitude and the frames come out whole too.
///
/// throws   InputError if there is no such time of at most kMostPatternFrames frames and kLongestPattern, or fewer than
///          2 frames; if a period has too few frames to show it: 2 and fewer, or fewer than its points
PatternClock pattern_clock(const PatternSpec& spec);

/// Warnings:
///   few_frames    a period of the path or the amplitude has fewer than 6 frames
///   part_period   the pattern repeats within a period, where it jumps
std::vector<std::string> clock_warnings(const PatternSpec& spec, const PatternClock& clock);

/// Share of the largest pressure that is wanted at a time: 1 - depth (1 - cos(2 pi hz t)) / 2, or 1.
double wanted_share(const PatternSpec& spec, double time);

/// What each frame of a pattern wants of the skin at full strength.
struct PatternSpots {
  std::vector<Eigen::Index> faces;              // of all spots and watched places, U, ascending
  Eigen::MatrixXd amplitudes;                   // p', U x F [Pa]; F is 1 where the target itself is meant
  Eigen::MatrixXd shares;                       // s, U x F: of each face's area, 0: silent
  std::vector<Eigen::Index> middle;             // which of the faces is nearest to the spot's middle, F
  std::vector<std::vector<TargetBox>> boxes{};  // that the spot's border is of, F
  std::vector<std::vector<int>> box{};          // which of them each of the spot's faces belongs to, F
};

/// A place where the pressure over time is of interest: a watched landmark, or one of the pattern itself.
struct PatternPoint {
  std::string name;
  Vector3 at;         // on the skin [m]
  Eigen::Index face;  // of the mesh
};

/// The watched landmarks, then start and, of a circle, the opposite side; both ends of a line; every point; the middle
/// of the target.
///
/// throws   InputError if the body is cut, a place is too far from the skin (SkinStrokes), or the path is shorter than
///          0.1 mm on the skin
std::vector<PatternPoint> pattern_points(const PatternSpec& spec, const Model& model);

/// A spot is the disc (SkinStrokes) about the skin's point nearest to the path.
///
/// points   their faces are among those of the result
/// throws   InputError if the path is too far from the skin, or the mesh has fewer than kFewestSolved edges per
///          wavelength at a spot, unless the scene allows it
PatternSpots pattern_spots(const PatternSpec& spec, const PatternClock& clock, const std::vector<PatternPoint>& points,
                           const Model& model);

/// What a pattern takes, about.
struct PatternCost {
  PatternClock clock;
  Eigen::Index faces = 0;    // that any frame uses, U
  double memory_mib = 0;     // of all of it
  double available_mib = 0;  // now
  double seconds = 0;
  double files_mib = 0;                 // of pattern.csv and, where it is written, pattern.h5
  std::vector<std::string> warnings{};  // of the clock, and of a pressure of its own that the array cannot make
};

/// Without solving it: by spots of at most 64 frames, and what this machine does now.
///
/// model    of a scene with a pattern
/// throws   InputError as pattern_clock, pattern_points and pattern_spots
PatternCost pattern_cost(const Model& model);

/// Refuses a pattern that would not fit the memory that is free now.
void require_memory(const PatternCost& cost);

/// What a frame does besides the metrics of its score.
struct PatternFrame {
  double level = 0;                   // amplitude of the channels
  double turn = 0;                    // largest change of a phase since the frame before, of the first since the last
  double ring_error = kNotComputed;   // relative_error in the middle of the frame with transducers that ring up
  double alone_error = kNotComputed;  // of the frame solved by itself, where it was
  double alone_seconds = kNotComputed;
};

/// The sound at a place over one pass. Radiation pressure is |p|^2 / (4 rho c^2), without flow along the skin.
struct PatternSound {
  PatternPoint point;
  Eigen::VectorXd pressure;         // |p|, F [Pa]
  Eigen::VectorXd radiation;        // F [Pa]
  std::vector<SpectralLine> lines;  // of the radiation, to kHighestLine [Pa2]

  double mean_square() const { return 0.5 * pressure.squaredNorm() / static_cast<double>(pressure.size()); }  // [Pa2]
};

struct Pattern {
  PatternClock clock;
  /// One method: a frame and a score for each of the pattern's; instants of some, on the whole skin. Scores of instants
  /// that want sound have a relative_error_radiation.
  Motion motion;
  std::vector<PatternFrame> frames{};
  std::vector<PatternSound> sounds{};
  Eigen::Index faces = 0;         // that any frame uses
  Eigen::Index outside_rows = 0;  // of R
  double reduced_off = 0;         // largest difference of relative_error at instants: all faces against those and R
};

struct PatternOptions {
  std::string command_line;    // kept as provenance
  int threads = 1;             // likewise; the caller has set them
  std::optional<int> check{};  // each of how many frames is solved by itself too, beside the worst that follows another
};

/// Solves the scene's pattern on its still hand. The rows of H of all faces that it uses, and R of the others, are
/// computed once. Then the frames are solved one by one (solve_sequence). The amplitude modulation scales the
/// drive of each frame. Scores are of the solving mesh, by those rows:
///
/// Warnings beside those of the model and the clock:
///   below_wanted    frames reach less than half of what they want, which is more than the array can make
///   frames_behind   a frame's error is more than 2 points above that of the frame solved by itself
///
///   relative_error^2 = 1 - C^2 / (E W),   C = sum s A |p| p',   W = sum s A p'^2,   E = sum_U A |p|^2 + |R q|^2 / w_Z
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
