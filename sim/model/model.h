#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/field/evaluate.h"
#include "sim/field/skin_problems.h"
#include "sim/field/target.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/model/bodies.h"
#include "sim/model/evaluation.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// What skin of the bodies a mesh is of; figures are of the whole.
enum class SkinExtent {
  kWhole,
  kPart,  // what keep_within leaves
};

inline std::string to_string(SkinExtent extent) { return extent == SkinExtent::kPart ? "part" : "whole"; }

/// What stays of a model while its bodies move.
struct FixedModel {
  Scene scene;  // as its motion begins
  Wave wave;
  TransducerArray array;            // as the solver assumes it
  std::vector<int> owner;           // M: number of the body a face is of
  std::vector<unsigned char> skin;  // M: 0 near the caps of keep_within, else 1
  std::vector<int> cut{};           // numbers of the bodies that keep_within cut
  double shadowed = 0;              // share of the skin beyond that other bodies hide from more than half of the array
  Evaluation evaluation{};
  MeshReport report{};  // on the solver's mesh
  std::vector<FieldGrid> fields{};

  /// What skin the solving mesh of a run is of; its metrics are of the whole.
  SkinExtent solved_skin() const { return cut.empty() ? SkinExtent::kWhole : SkinExtent::kPart; }
};

/// A scene made concrete: everything that a run computes with, in the world's frame. The models of all instants of a
/// motion share what stays.
struct Model {
  std::shared_ptr<const FixedModel> fixed;
  Posture posture;  // of the scene
  BodyPlan plan;
  RigidMotion own_frame;                // from the world's frame into the first body's own
  Body body;                            // what the solver sees: of several bodies one mesh, one behind the other
  SkinPatches beyond;                   // of those cut: the skin that is not solved, as the solver sees it
  std::vector<TargetBox> boxes;         // empty without a target
  std::optional<TriangleMesh> truth{};  // with sensing: the same triangles where the skin really is
};

/// The skin that keep_within leaves to its incident pressure.
struct BeyondSkin {
  SkinPatches patches;
  double shadowed = 0;  // share of their area that other bodies hide from more than half of the array
};

/// The skin of bodies beyond keep_within: what no face of the solving mesh with skin = 1 covers. Patches are at most
/// 0.9 wavelengths apart. There are also at least two patches for each drive that is needed to span what all
/// channels do to that skin (expected_drives). With fewer than one, the phases send sound between the patches.
///
/// bodies      of Extent::kSolved
/// count       of patches; none: as said
BeyondSkin beyond_skin(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array, double wavelength,
                       std::optional<Eigen::Index> count = std::nullopt);

/// Builds the mesh, the array, the target's boxes and the grids of a scene and checks that they go together.
///
/// throws   InputError on a mesh that is no closed surface, an unknown landmark, bodies that touch, a transducer inside
///          a body or nearer than 1 mm to its skin, a body that crosses the board of an array's unit, a target that
///          holds no face, every face or a cap of keep_within, fewer than kFewestSolved edges per wavelength near the
///          target unless the scene allows it
///
/// kept   meshes of scenes before this one
Model build_model(const Scene& scene, KeptBodies* kept = nullptr);

/// Edges per wavelength near the target, by the mean face, below which no pressure there means anything.
inline constexpr double kFewestSolved = 1.5;

Medium build_medium(const MediumSpec& spec, double frequency);

/// The array of a scene as it was designed, in the world's frame.
/// throws   InputError as make_array and require_real_array
TransducerArray build_array(const ArraySpec& spec, const Wave& wave);

/// Whether anything is to be pressed on: the target asks for sound, and every box of it holds a face. A motion may take
/// either away.
bool presses(const Model& model, const TriangleMesh& mesh);
bool presses(const Model& model);

/// throws   InputError if a transducer of the model is inside a body or nearer than 1 mm to its skin, a body crosses
///          the board of an array's unit, two bodies are not apart, or the target reaches a cap of keep_within
void require_clear(const Model& model);

/// The boxes of a target on a model's body, with those of its points, lines and mask. Their places are at a landmark of
/// the body where it is now, or where the scene says.
///
/// reach    points and lines farther than this from the skin are refused [m]
/// throws   InputError on an unknown landmark, or as SkinStrokes
std::vector<TargetBox> build_boxes(const TargetSpec& spec, const Model& model, double reach = SkinStrokes::kReach);

/// The skin of a model outside the target, which the phases are to keep silent.
OutsideSkin outside_skin(const Model& model);

/// The target of a scene on its model. A scene that leaves the pressure open (`best`) gets 1 Pa.
/// throws   InputError as make_target; std::logic_error if the scene has no target
Target build_target(const Model& model);
/// The same on another mesh of the same body.
Target build_target(const Model& model, const TriangleMesh& mesh);

/// The largest amplitude p' that the target of a scene wants [Pa]: of a radiation pressure that without flow along the
/// skin. 1 if the scene leaves it open.
double wanted_pressure(const Model& model);

}  // namespace touchfield
