#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/core/types.h"
#include "sim/field/target.h"
#include "sim/hand/hand.h"
#include "sim/mesh/remesh/mesh_quality.h"

namespace touchfield {

/// A rigid motion: the anchor (a landmark, or the body's or array's own origin if empty) lands on `at` after a rotation
/// about the anchor, extrinsic about x, y, z.
struct Placement {
  std::string landmark;
  Vector3 at = Vector3::Zero();      // [m]
  Vector3 angles = Vector3::Zero();  // [rad]
};

struct HandShape {
  std::string pose = HandOptions{}.pose;
  double breadth = HandOptions{}.breadth;
  double length = HandOptions{}.length;
  HandSide side = HandSide::kRight;
  HandJoints joints{};
  double forearm = kUsualForearm;  // 0: the hand alone
  bool forearm_given = false;      // else the usual one
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
  std::optional<double> near_target;   // [m], within `within` of the centre of each target box, and along lines
  std::map<std::string, double> near;  // [m], within `within` of a landmark
  double within = 15e-3;               // [m]
  double growth = EdgeSizing::kGrowth;

  bool graded() const { return near_target || !near.empty(); }
  double finest() const;
  EdgeSpec scaled(double factor) const;
};

/// Edges of a forearm over those of its hand's far skin, where edges are graded.
inline constexpr double kForearmEdge = 2.0;

/// Edges of a built-in hand in a scene that says nothing of them.
struct UsualHandEdges {
  static constexpr double kNearTarget = 1.2e-3;   // [m], of a scene with a target
  static constexpr double kFar = 6.5e-3;          // [m], likewise
  static constexpr double kWithin = 15e-3;        // [m], likewise
  static constexpr double kWithoutTarget = 3e-3;  // [m], everywhere

  static EdgeSpec of_scene(bool has_target);
};

struct BodySpec {
  std::string name;  // empty if it is the scene's only body
  std::variant<HandShape, SphereShape, CapsuleShape, BoxShape, MeshShape> shape;
  Placement place;
  std::optional<EdgeSpec> edge;       // absent: a mesh from a file as it is; a hand that was read has some
  std::optional<double> keep_within;  // [m] of the target; scattering is solved there alone
};

/// The landmark that every scene with one array has: the point of the skin nearest to it.
inline constexpr const char* kNearestToArray = "nearest_array";

struct TargetPlace {
  std::string at;                    // a landmark; or else `centre`
  Vector3 offset = Vector3::Zero();  // from the landmark [m]
  Vector3 centre = Vector3::Zero();  // [m]
};

struct TargetBoxSpec : TargetPlace {
  Vector3 size = Vector3::Zero();    // [m]
  Vector3 angles = Vector3::Zero();  // [rad]
  double level = 1.0;                // of what the target wants
};

/// A disc on the skin nearest to a place.
struct TargetPointSpec : TargetPlace {
  double diameter = 0;  // [m]
  double level = 1.0;   // of what the target wants
};

/// A strip on the skin, through the skin nearest to some places.
struct TargetLineSpec {
  std::vector<TargetPlace> points;  // 2 or more
  double width = 0;                 // [m]
  double level = 1.0;               // of what the target wants
};

/// Levels of the faces of a body's mesh file.
struct TargetMaskSpec {
  std::string file;            // absolute
  std::vector<double> levels;  // of what the target wants, one per face of the mesh file, 0 to 1, one of them > 0
};

struct TargetSpec {
  std::vector<TargetBoxSpec> boxes;
  std::vector<TargetPointSpec> points;
  std::vector<TargetLineSpec> lines;
  std::optional<TargetMaskSpec> mask;  // on the scene's only body
  TargetProfile profile = TargetProfile::kUniform;
  std::optional<double> pressure;  // the largest one, of `quantity` [Pa]; absent: best, of the amplitude
  TargetQuantity quantity = TargetQuantity::kPressure;
};

}  // namespace touchfield
