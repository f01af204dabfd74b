#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/acoustics/medium.h"
#include "sim/acoustics/transducer_array.h"
#include "sim/bem/scheme.h"
#include "sim/core/types.h"
#include "sim/gpu/compute_device.h"
#include "sim/scene/body_spec.h"
#include "sim/scene/motion_spec.h"
#include "solvers/phase/phase_methods.h"

namespace touchfield {

struct GridArray {
  std::array<int, 2> count{44, 34};
  double pitch = kAutd3Pitch;  // [m]
};
struct Autd3Array {
  std::optional<std::array<int, 2>> layout;  // tiles edge to edge; or else
  std::vector<Placement> units;              // each unit's own place (transducer 0 on `at`)
  double pitch = kAutd3Pitch;
};
struct SonicsurfaceArray {};
struct PositionsArray {
  Points points;                     // [m]
  Points axes;                       // unit vectors
  std::vector<Eigen::Index> dead{};  // what a file says of channels, until the scene's calibration has it
};
struct PlaneWaveArray {
  Vector3 direction = Vector3::UnitZ();
  double amplitude = 1;  // [Pa]
};

/// Which of the two arrays a response belongs to: the one that the solver reckons with, the one that sounds.
enum class ResponseOf { kBoth, kSolver, kTruth };

/// Measured responses of the channels.
struct CalibrationSpec {
  std::vector<double> gain;   // one per channel; 0: dead
  std::vector<double> phase;  // [rad]
  std::string file;           // that they are read from; empty in a scene that is read
  ResponseOf in = ResponseOf::kBoth;
};

/// Responses drawn at random.
struct ToleranceSpec : ChannelTolerances {
  unsigned seed = 1;
  ResponseOf in = ResponseOf::kTruth;
};

struct ArraySpec {
  std::variant<GridArray, Autd3Array, SonicsurfaceArray, PositionsArray, PlaneWaveArray> layout;
  Vector3 at = Vector3::Zero();
  Vector3 angles = Vector3::Zero();
  Directivity::Kind directivity = Directivity::Kind::kT4010a1;
  double piston_radius = 4.5e-3;                  // [m]
  double level = 1.0;                             // 0 < level <= 1
  double source_strength = kAutd3SourceStrength;  // [Pa m]
  std::optional<CalibrationSpec> calibration;
  std::optional<ToleranceSpec> tolerances;
  std::optional<int> phase_levels;  // phase levels to which the true array rounds solved phases
};

/// How many channels an array will have.
Eigen::Index channel_count(const ArraySpec& spec);

/// Responses that a scene gives its channels: calibration times tolerances, of those that belong to the array.
struct ChannelResponses {
  ChannelResponse solver;  // what the solver reckons with
  ChannelResponse truth;   // what sounds
};
ChannelResponses channel_responses(const ArraySpec& spec);

/// Whether the solver reckons with other channels than those that sound, as far as the keys say.
bool solver_mistakes_channels(const ArraySpec& spec);

/// Where an iterative method starts from.
struct StartSpec {
  enum class Kind {
    kAuto,  // of surface the most promising of some annealed starts; of the others zero
    kZero,
    kRandom,
    kAdjoint,   // the field sent back from the target
    kSpectral,  // the relaxed problem's own answer
    kPrevious,  // the phases of a run
  };
  Kind kind = Kind::kAuto;
  unsigned seed = 0;   // of kRandom
  int restarts = 1;    // of kRandom: seeds seed, seed + 1, ...; the best solution is kept
  std::string file;    // of kPrevious: run.h5
  bool among = false;  // of kPrevious: its phases are one of the starts that kAuto tries
  std::string method;  // of kPrevious: whose phases; empty: the method of the same name, or else the first
};

inline constexpr Scheme kDefaultScheme = Scheme::kBurtonMillerPolished;

struct MethodSpec {
  const PhaseMethod* kind = &phase_method("paper");
  std::string name;  // `as`, or the method's own name
  Scheme scheme = kDefaultScheme;
  int iterations = MethodSettings{}.iterations;  // of an iterative method
  StartSpec start;
  bool free_amplitudes = false;                 // of surface and radiation
  bool free_level = true;                       // likewise
  std::optional<ChannelTolerances> tolerances;  // likewise: the expected misfit is minimised
  double outside_weight = 0.1;                  // of radiation, nu
  FaceWeights faces = FaceWeights::kEqual;      // of paper and unscattered
  std::vector<double> phases;                   // of `fixed`: one for all, or one per channel [rad]
  std::vector<double> amplitudes = {1.0};       // likewise, 0..1
};

enum class SolverChoice { kAuto, kLu, kGmres, kMatrixFree, kFft };  // gmres: with a stored matrix
enum class PrecisionChoice { kAuto, kDouble, kSingle };
enum class ResonanceCheck { kAuto, kAlways, kNever };

/// How the equations of the boundary elements, B p = b, are set up and solved.
struct SolverSpec {
  ComputeDevice device{};
  SolverChoice solver = SolverChoice::kAuto;
  PrecisionChoice precision = PrecisionChoice::kAuto;
  double tolerance = SolverOptions{}.tolerance;  // |b - B p| / |b| of an iterative solution
  bool refine = SolverOptions{}.refine;       // single precision: until the residual computed in double is that small
  int max_steps = SolverOptions{}.max_steps;  // of GMRES
  ResonanceCheck resonance_check =
      ResonanceCheck::kAuto;                   // whether the plain and the Burton-Miller pressures are compared
  double coupling = SystemOptions{}.coupling;  // of Burton-Miller: eta = coupling i/k
  double split_ratio =
      FaceRule{}.split_ratio;  // near faces are split while distance < split_ratio sqrt(area of the piece)

  bool operator==(const SolverSpec&) const = default;
};

struct SolveSpec {
  std::vector<MethodSpec> methods;  // defaults of `solve` filled in
  Scheme scheme = kDefaultScheme;
  int iterations = MethodSettings{}.iterations;
  StartSpec start;
  double outside_weight = 1.0;     // of pressure outside the target, in surface and lbfgs
  bool optimality_bound = false;   // whether a lower bound of surface's cost is computed
  bool allow_coarse_mesh = false;  // whether a mesh that is too coarse at the target is solved all the same
  SolverSpec solver;
};

/// Edges of whole bodies away from the target, up to which an evaluation's pressure counts [wavelengths].
inline constexpr double kCoarsestEvaluation = 0.35;

/// The model whose pressures a result is evaluated by.
struct EvaluationSpec {
  enum class Kind {
    kAuto,  // kSame of whole bodies with edges of at most kCoarsestEvaluation wavelengths, else kEdge; build_model
            // decides
    kNone,
    kSame,   // the model that was solved
    kEdge,   // the same body meshed again
    kSplit,  // the same mesh with every face in four
  };
  Kind kind = Kind::kAuto;
  Scheme scheme = kDefaultScheme;  // of kEdge and kSplit
  EdgeSpec edge;                   // of kEdge
  int splits = 1;                  // of kSplit: how often
};

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
  const PhaseMethod* method = &phase_method("surface");
  double diameter = 4e-3;           // of the spot [m]
  double frames_hz = 1000;          // [1/s]
  std::optional<double> seconds;    // absent: the shortest time after which all of it repeats
  std::optional<double> most_turn;  // of a channel's phase from frame to frame [rad]
  int iterations = 24;              // of each frame after the first
  std::optional<double> pressure;   // [Pa]; absent: the target's
  std::vector<std::string> watch;   // landmarks
  std::optional<double> ring_up;    // time constant of the transducers [s]
};

/// The skin's mechanics, for what it does under the pressure of a result (sim/run/felt.h).
struct FeltSpec {
  enum class Layers { kOnBone, kHalfSpace, kDermisOnFat };

  Layers layers = Layers::kOnBone;
  double bone = 4e-3;               // its depth [m], of kOnBone
  double shear = 30e3;              // |mu| at 200 Hz of the middle skin [Pa]
  double tan_delta = 0.4;           // loss
  double modulation_hz = 200;       // of a still's sound
  std::optional<double> frames_hz;  // of a pattern, instead of its own [1/s]
  double highest_hz = 600;          // of the lines of a pattern
  std::optional<Vector3> at;        // what the patch is about [m]; absent: the target's or path's middle
  std::vector<Vector3> points;      // where spectra are wanted [m]
  std::string reference;            // method that others are compared with; empty: the first
};

struct MediumSpec {
  double temperature = kRoomTemperature;  // [K]
  double humidity = 0.5;                  // 0..1
  bool absorption = false;
  std::optional<double> sound_speed;  // [m/s], instead of the temperature's
  std::optional<double> density;      // [kg/m3], likewise
};

struct FieldSpec {
  std::string name;
  std::string plane;                 // xy, xz, yz; empty: a box of points, or one point
  Vector3 centre = Vector3::Zero();  // of the plane or box, or the point [m]
  Vector3 size = Vector3::Zero();    // extents along x, y, z [m], 0 across a plane and of one point
  double spacing = 1e-3;             // [m]
};

struct WriteSpec {
  bool h5 = true;
  bool vtp = true;
  bool vti = true;
  bool png = true;
  bool transfer = false;  // the transfer matrix, in run.h5: never without h5
};

/// Frequencies of a scene [Hz].
inline constexpr double kLeastFrequency = 1e3;
inline constexpr double kMostFrequency = 200e3;

/// What a motion may change of a scene: where its bodies are, and what is wanted on them.
struct Posture {
  std::vector<BodySpec> bodies;  // 1 or more
  std::optional<TargetSpec> target;
};

/// A scene as read and checked, in SI units, every default filled in.
struct Scene : Posture {
  std::string name;
  MediumSpec medium;
  double frequency = 40e3;  // [Hz]
  ArraySpec array;
  std::optional<SensingNoise> sensing;  // what the solver sees of the bodies; the evaluation sees them as they are
  SolveSpec solve;
  EvaluationSpec evaluation;
  std::vector<FieldSpec> fields;
  WriteSpec write;
  std::optional<MotionSpec> motion;    // the rest of the scene is the still that it starts from
  std::optional<PatternSpec> pattern;  // likewise of the still
  std::optional<FeltSpec> felt;        // what the skin does is computed too
};

}  // namespace touchfield
