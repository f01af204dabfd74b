#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/acoustics/directivity.h"
#include "sim/acoustics/medium.h"
#include "sim/acoustics/transducer_array.h"
#include "sim/bem/scattering_solver.h"
#include "sim/bem/scheme.h"
#include "sim/body/hand.h"
#include "sim/body/perturb.h"
#include "sim/core/rigid_motion.h"
#include "sim/gpu/compute_device.h"
#include "sim/mesh/remesh/edge_sizing.h"
#include "sim/target/gram.h"
#include "sim/target/target.h"
#include "solvers/phase/phase_methods.h"

namespace touchfield {

/// A rigid motion: the anchor (a landmark, or the body's or array's own origin if empty) lands on `at` after a rotation
/// about the anchor, extrinsic about x, y, z.
struct Placement {
  std::string landmark;
  Vector3 at = Vector3::Zero();      // [m]
  Vector3 angles = Vector3::Zero();  // [rad]
};

struct MediumSpec {
  double temperature = kRoomTemperature;  // [K]
  double humidity = 0.5;                  // 0..1
  bool absorption = false;
  std::optional<double> sound_speed;  // [m/s], instead of the temperature's
  std::optional<double> density;      // [kg/m3], likewise
};

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
  std::vector<double> gain;   // one a channel; 0: dead
  std::vector<double> phase;  // [rad]
  std::string file;           // that they are read from; empty in a scene that is read
  ResponseOf in = ResponseOf::kBoth;
};

/// Responses drawn at random.
struct SpreadSpec : ResponseSpread {
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
  std::optional<SpreadSpec> spread;
  std::optional<int> phase_levels;  // steps a turn that the true array rounds solved phases to
};

/// How many channels an array will have.
Eigen::Index channel_count(const ArraySpec& spec);

/// Responses that a scene gives its channels: calibration times spread, of those that belong to the array.
struct ChannelResponses {
  ChannelResponse solver;  // what the solver reckons with
  ChannelResponse truth;   // what sounds
};
ChannelResponses channel_responses(const ArraySpec& spec);

/// Whether the solver reckons with other channels than those that sound, as far as the keys say.
bool solver_mistakes_channels(const ArraySpec& spec);

struct HandShape {
  std::string pose = HandOptions{}.pose;
  double breadth = HandOptions{}.breadth;
  double length = HandOptions{}.length;
  HandSide side = HandSide::kRight;
  HandJoints joints;
  double forearm = HandOptions{}.forearm;
};
struct SphereShape {
  double radius = 0;
};
struct CapsuleShape {
  double radius = 0;
  double length = 0;
};
struct BoxShape {
  Vector3 size = Vector3::Zero();
};
/// Meshes of one body with the same triangles, and when it was so.
struct MeshSeries {
  struct Mesh {
    std::string file;    // absolute or relative to the working directory
    double seconds = 0;  // [s], rising from mesh to mesh
  };
  std::string folder;
  std::string times;         // the table that names the files
  std::vector<Mesh> meshes;  // 1 or more
};
struct MeshShape {
  std::string file;    // absolute or relative to the working directory; of a series its first
  std::string named;   // where the scene names it, for messages: "scene.yaml:4:11: body.mesh.file"; empty: unknown
  double unit = 1e-3;  // metres per file unit
  std::string unit_name = "mm";
  bool unit_given = false;                   // else mm is a guess that the file's size has to bear out
  std::optional<double> resurface;           // edge of a new skin made of the file's faces [m]; absent: they are it
  std::map<std::string, Vector3> landmarks;  // in the file's frame [m]
  std::optional<MeshSeries> series;
};

/// Edge length asked for as a function of place, see EdgeSizing.
struct EdgeSpec {
  double far = 0;                      // [m]; everywhere if nothing else is said
  std::optional<double> near_target;   // [m], within `within` of the centre of each target box
  std::map<std::string, double> near;  // [m], within `within` of a landmark
  double within = 15e-3;               // [m]
  double growth = EdgeSizing::kGrowth;

  bool graded() const { return near_target || !near.empty(); }
  double finest() const;
  EdgeSpec scaled(double factor) const;
};

/// Edges of a built-in hand in a scene that says nothing of them.
struct UsualHandEdges {
  static constexpr double kNearTarget = 1.2e-3;   // [m], of a scene with a target
  static constexpr double kFar = 6.5e-3;          // [m], likewise
  static constexpr double kWithin = 15e-3;        // [m], likewise
  static constexpr double kWithoutTarget = 3e-3;  // [m], everywhere

  static EdgeSpec of_scene(bool has_target);
};

/// What the skin beyond keep_within is for the phases and the judge.
enum class Beyond {
  kIncident,  // quiet skin, by the incident pressure at points of it; judged with the rest
  kNothing,   // not there: the part is taken for the body
};

struct BodySpec {
  std::string name;  // empty if it is the scene's only body
  std::variant<HandShape, SphereShape, CapsuleShape, BoxShape, MeshShape> shape;
  Placement place;
  std::optional<EdgeSpec> edge;       // absent: a mesh from a file as it is; a hand that was read has some
  std::optional<double> keep_within;  // [m] of the target; scattering is solved there alone
  Beyond beyond = Beyond::kIncident;  // of keep_within
};

/// The landmark that every scene with one array has: the point of the skin nearest to it.
inline constexpr const char* kNearestToArray = "nearest_array";

struct TargetBoxSpec {
  std::string at;                    // a landmark; or else `centre`
  Vector3 offset = Vector3::Zero();  // from the landmark [m]
  Vector3 centre = Vector3::Zero();  // [m]
  Vector3 size = Vector3::Zero();    // [m]
  Vector3 angles = Vector3::Zero();  // [rad]
};

struct TargetSpec {
  std::vector<TargetBoxSpec> boxes;
  TargetProfile profile = TargetProfile::kUniform;
  std::optional<double> pressure;  // [Pa]; absent: best
};

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
  bool free_amplitudes = false;             // of surface
  bool free_level = true;                   // of surface
  FaceWeights faces = FaceWeights::kEqual;  // of paper and unscattered
  std::vector<double> phases;               // of `fixed`: one for all, or one a channel [rad]
};

enum class SolverChoice { kAuto, kLu, kGmres, kMatrixFree, kFft };  // gmres: with a stored matrix
enum class PrecisionChoice { kAuto, kDouble, kSingle };
enum class AlarmChoice { kAuto, kAlways, kNever };

/// How the equations of the boundary elements, B p = b, are set up and solved.
struct SolverSpec {
  ComputeDevice device{};
  SolverChoice solver = SolverChoice::kAuto;
  PrecisionChoice precision = PrecisionChoice::kAuto;
  double tolerance = SolverOptions{}.tolerance;  // |b - B p| / |b| of an iterative solution
  bool refine = SolverOptions{}.refine;        // single precision: until the residual computed in double is that small
  int max_steps = SolverOptions{}.max_steps;   // of GMRES
  AlarmChoice alarm = AlarmChoice::kAuto;      // whether the plain and the Burton-Miller pressures are compared
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
  double quiet_weight = 1.0;       // of pressure outside the target, in surface and lbfgs
  bool certificate = false;        // whether a lower bound of surface's cost is computed
  bool allow_coarse_mesh = false;  // whether a mesh that is too coarse at the target is solved all the same
  SolverSpec solver;
};

/// Faces up to which `judge.whole: auto` has the whole bodies.
inline constexpr int kWholeFaces = 12'000;

/// Edges of whole bodies away from the target, up to which a judge's pressure counts [wavelengths].
inline constexpr double kCoarsestJudge = 0.35;

/// The model whose pressures a result is judged by.
struct JudgeSpec {
  enum class Kind {
    kAuto,  // kSame of whole bodies with edges of at most kCoarsestJudge wavelengths, else kEdge; build_model decides
    kNone,
    kSame,   // the model that was solved
    kEdge,   // the same body meshed anew
    kSplit,  // the same mesh with every face in four
  };
  /// Out of use: whether a judge with edge lengths of its own has what `beyond: nothing` leaves out.
  enum class Whole {
    kUnsaid,  // no
    kAuto,    // where its mesh then has no more than kWholeFaces faces
    kYes,
    kNo,
  };
  Kind kind = Kind::kAuto;
  Scheme scheme = kDefaultScheme;  // of kEdge and kSplit
  EdgeSpec edge;                   // of kEdge
  Whole whole = Whole::kUnsaid;    // of kEdge
  int splits = 1;                  // of kSplit: how often
};

struct FieldSpec {
  std::string name;
  std::string plane;                 // xy, xz, yz; empty: a box of points
  Vector3 centre = Vector3::Zero();  // of the plane or box [m]
  Vector3 size = Vector3::Zero();    // extents along x, y, z [m], 0 across a plane
  double spacing = 1e-3;             // [m]
};

struct WriteSpec {
  bool h5 = true;
  bool vtp = true;
  bool vti = true;
  bool png = true;
  bool transfer = false;  // the transfer matrix, in run.h5: never without h5
};

/// value(t) = about + amplitude sin(2 pi hz t + phase), in the unit of the number that changes.
struct SineLaw {
  double amplitude = 0;
  double hz = 0;
  double phase = 0;             // [rad]
  std::optional<double> about;  // absent: the scene's own value
};
/// Through (t [s], value) by monotone cubics; constant before the first and after the last.
struct KeysLaw {
  std::vector<std::array<double, 2>> keys;
};
/// value(t) = the scene's own value + rate t.
struct RateLaw {
  double rate = 0;  // a second
};
using MotionLaw = std::variant<SineLaw, KeysLaw, RateLaw>;

/// A number of the scene that varies; its law is in the unit of the path.
struct MotionChange {
  std::string path;  // as VaryingNumber has it: body.place.at_mm[2]
  MotionLaw law;
};

/// A depth camera that is simulated. What its model is made of: sim/sensing/simulated_camera.h.
struct CameraSpec {
  std::string model = "d415";
  Vector3 at = Vector3::Zero();       // its eye [m]
  Vector3 look_at = Vector3::Zero();  // [m]
  double roll = 0;                    // about where it looks [rad]; 0: the image's right is level
  std::array<int, 2> resolution{640, 360};
  double disparity_noise = 0.08;  // [pixels], rms
  double depth_unit = 1e-3;       // of the image's numbers [m]
  double shift_error = 0;         // of its place as the fit is told it [m], in a direction that is drawn
  double turn_error = 0;          // likewise [rad]
};

/// Images of real cameras, or of `touchfield see`: docs/cameras.md.
struct RecordedSpec {
  std::string folder;
};

/// Joints that a hand tracker has recorded: sim/sensing/joint_table.h.
struct JointsSpec {
  std::variant<std::string, int> from;  // a table of them; or the UDP port on which they come while the motion plays
  RigidMotion pose;                     // from the tracker's frame to the world's
};

/// The loop of sensor, solver and array while the scene moves.
struct MotionSpec {
  enum class Target { kOnSkin, kInWorld };
  enum class Start { kPrevious, kZero };
  enum class Prediction { kNone, kLinear, kKalman };
  struct Sensor {
    double hz = 30;
    double latency = 0;  // from when a sample is taken until it is known [s]
    /// What the solver knows of the skin: where it is; that made worse by noise of its own in every sample; or what is
    /// fitted to images of cameras or to tracked joints.
    std::variant<std::monostate, SensingNoise, std::vector<CameraSpec>, RecordedSpec, JointsSpec> sight;
    unsigned seed = 1;              // of what cameras get wrong
    std::optional<HandShape> hand;  // that is fitted; absent: the scene's pose, of images in mean size
    std::array<Vector3, 2> workspace{Vector3{-0.3, -0.3, 0.05},  // the corners of the box that hands are looked for in,
                                     Vector3{0.3, 0.3, 0.6}};    // the world's frame [m]
  };

  /// What a frame may take; the mesh, the scheme and the steps are then chosen for it.
  struct Frame {
    double budget = 0;  // [s]
  };

  double seconds = 0;
  std::vector<MotionChange> changes;
  Target target = Target::kOnSkin;
  double frames_hz = 20;
  int iterations = 5;
  Start start = Start::kPrevious;
  bool steer = true;
  std::optional<Frame> frame;
  Sensor sensor;
  std::optional<double> solve;  // what a frame takes [s]; absent: what it is measured to take
  double array_delay = 1e-3;    // from a frame's phases until they sound [s]
  Prediction predict = Prediction::kNone;
  double score_hz = 61;
  double stale = 0.15;  // of a sample: older ones are not felt, `live` is quiet [s]
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
  std::optional<SensingNoise> sensing;  // what the solver sees of the bodies; the judge sees them as they are
  SolveSpec solve;
  JudgeSpec judge;
  std::vector<FieldSpec> fields;
  WriteSpec write;
  std::optional<MotionSpec> motion;  // the rest of the scene is the still that it starts from
};

}  // namespace touchfield
