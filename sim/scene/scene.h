#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/acoustics/directivity.h"
#include "sim/acoustics/medium.h"
#include "sim/bem/scheme.h"
#include "sim/mesh/hand.h"
#include "sim/rendering/target.h"

namespace touchfield {

/// A rigid motion: the anchor (a landmark, or the body's or array's own origin if empty) lands on `at` after a rotation
/// about the anchor, extrinsic about x, y, z.
struct Placement {
  std::string landmark;
  Vector3 at = Vector3::Zero();      // [m]
  Vector3 angles = Vector3::Zero();  // [rad]
};

struct MediumSpec {
  double temperature = 293.15;  // [K]
  double humidity = 0.5;        // 0..1
  bool absorption = false;
  std::optional<double> sound_speed;  // [m/s], instead of the temperature's
  std::optional<double> density;      // [kg/m3], likewise
};

struct GridArray {
  std::array<int, 2> count{44, 34};
  double pitch = 10.16e-3;  // [m]
};
struct Autd3Array {
  std::optional<std::array<int, 2>> layout;  // tiles edge to edge; or else
  std::vector<Placement> units;              // each unit's own place (transducer 0 on `at`)
  double pitch = 10.16e-3;
};
struct SonicsurfaceArray {};
struct PositionsArray {
  Points points;  // [m]
  Points axes;    // unit vectors
};
struct PlaneWaveArray {
  Vector3 direction = Vector3::UnitZ();
  double amplitude = 1;  // [Pa]
};

struct ArraySpec {
  std::variant<GridArray, Autd3Array, SonicsurfaceArray, PositionsArray, PlaneWaveArray> layout;
  Vector3 at = Vector3::Zero();
  Vector3 angles = Vector3::Zero();
  Directivity::Kind directivity = Directivity::Kind::kT4010a1;
  double piston_radius = 4.5e-3;   // [m]
  double level = 1.0;              // 0 < level <= 1
  double source_strength = 4.386;  // [Pa m]
};

struct HandShape {
  std::string pose = "index_up";
  double breadth = 88.3e-3;
  double length = 193.3e-3;
  HandSide side = HandSide::kRight;
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
struct MeshShape {
  std::string file;    // absolute or relative to the working directory
  double unit = 1e-3;  // metres per file unit
  std::string unit_name = "mm";
  std::map<std::string, Vector3> landmarks;  // in the file's frame [m]
};

struct BodySpec {
  std::variant<HandShape, SphereShape, CapsuleShape, BoxShape, MeshShape> shape;
  Placement place;
  std::optional<double> edge;  // [m]; absent for a mesh from a file
};

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

enum class MethodKind { kPaper, kUnscattered, kFocus, kFixed };

struct StartSpec {
  enum class Kind { kZero, kRandom };
  Kind kind = Kind::kZero;
  unsigned seed = 0;
};

struct MethodSpec {
  MethodKind kind = MethodKind::kPaper;
  std::string name;  // `as`, or the method's own name
  Scheme scheme = Scheme::kPaper;
  int iterations = 30;  // of an iterative method
  StartSpec start;
  std::vector<double> phases;  // of `fixed`: one for all, or one a channel [rad]
};

struct SolveSpec {
  std::vector<MethodSpec> methods;  // defaults of `solve` filled in
  Scheme scheme = Scheme::kPaper;
  int iterations = 30;
  StartSpec start;
};

enum class Judge { kNone, kSame };

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
};

/// A scene as read and checked, in SI units, every default filled in.
struct Scene {
  std::string name;
  MediumSpec medium;
  double frequency = 40e3;  // [Hz]
  ArraySpec array;
  BodySpec body;
  std::optional<TargetSpec> target;
  SolveSpec solve;
  Judge judge = Judge::kSame;
  std::vector<FieldSpec> fields;
  WriteSpec write;
};

/// Spellings of the names scenes and results use.
std::string to_string(MethodKind kind);

}  // namespace touchfield
