#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sim/core/rigid_motion.h"
#include "sim/hand/body.h"
#include "sim/model/meshed_body.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// How a scene's bodies are put into the world. The plan has to be the same for every mesh of the bodies, since a
/// landmark lies a little elsewhere on another mesh of its body.
struct BodyPlan {
  struct Entry {
    Vector3 anchor = Vector3::Zero();      // the point in the body's own frame that lands on place.at [m]
    Vector3 kept_about = Vector3::Zero();  // keep_within's centre in the body's own frame [m]
    bool pressed = false;                  // a place of the target is a landmark of the body
  };
  std::vector<Entry> bodies;
  std::vector<Vector3> targets;          // centres of the target's boxes and points, along the straight lines between
                                         // the points of its lines, and all over its mask, in the world [m]
  std::optional<TargetBox> mask;         // the target's, in the own frame of the scene's only body
  std::vector<std::string> warnings;     // about the units of mesh files
  std::vector<std::string> notes;        // what resurfacing did to mesh files, a line each
  std::vector<GivenLandmark> landmarks;  // of mesh files

  /// From the world's frame into a body's own.
  RigidMotion own_frame(const Posture& scene, std::size_t body) const;
  Vector3 to_own(const Posture& scene, std::size_t body, const Vector3& world) const {
    return own_frame(scene, body)(world);
  }
};

/// How much of the bodies is meshed.
enum class Extent {
  kSolved,  // what keep_within leaves
  kWhole,
};

/// All bodies of a scene as one surface, in the world's frame.
struct PlacedBodies {
  Body body;               // landmarks: of a single body under their own names; of several as body.landmark, and under
                           // their own names where only one body has one
  std::vector<int> owner;  // M: number of the body a face is of
  std::vector<unsigned char> skin;  // M: 1 on skin of the body, 0 on caps of keep_within and within a tenth of it
                                    // from them
  struct Whole {
    int owner;
    TriangleMesh mesh;
  };
  std::vector<Whole> whole;  // the bodies that keep_within cut, before it did
};

/// Finds anchors and centres without meshing finely.
///
/// near_array   the point of a surface, in the world's frame, that is nearest to the array
/// kept         landmarks and resurfaced mesh files of scenes before this one
/// throws       InputError on an unknown landmark or one far off its mesh, a mesh file that is not the closed surface
///              of a body or whose unit is not given and not surely mm or a slip, keep_within without a target
BodyPlan plan_bodies(const Scene& scene, const std::function<Vector3(const TriangleMesh&)>& near_array,
                     KeptBodies* kept = nullptr);

/// By which edge lengths bodies are meshed.
struct BodyEdges {
  const EdgeSpec* edge = nullptr;                             // taken for every body's own edge_mm where it is given
  double coarsest = std::numeric_limits<double>::infinity();  // [m]: longer far edges of edge_mm are cut down to it
};

/// Meshes every body by its edge lengths and puts it into its place. A body without skin within half of keep_within is
/// left out if nothing of the target stands on it.
///
/// kept    meshes of scenes before this one, used where a body is the same in its own frame
/// throws  InputError if two bodies touch or one lies in another, or no skin of a body that may not be left out, or of
///         all bodies, is within half of keep_within
PlacedBodies build_bodies(const Scene& scene, const BodyPlan& plan, const BodyEdges& edges, Extent extent,
                          KeptBodies* kept = nullptr);

/// throws   InputError if two of the bodies that one mesh holds, one behind the other, cut each other, lie one in the
///          other or are nearer than 0.05 mm
///
/// owner   M: number of the body a face is of
void require_apart(const Posture& posture, const TriangleMesh& mesh, const std::vector<int>& owner);

/// The size field in the world's frame of a scene with one body; nothing if there are several, or no edge_mm.
std::optional<EdgeSizing> world_sizing(const Scene& scene, const BodyPlan& plan);

/// The size field of a body in its own frame; edge_mm must be given.
///
/// kept   resurfaced mesh files of scenes before this one
EdgeSizing sizing_of(const Scene& scene, const BodyPlan& plan, std::size_t body, const EdgeSpec& edge,
                     KeptBodies* kept = nullptr);

}  // namespace touchfield
