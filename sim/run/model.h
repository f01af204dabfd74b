#pragma once

#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/field/field_grid.h"
#include "sim/mesh/body.h"
#include "sim/mesh/inspect.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// A scene made concrete: everything that a run computes with, in the world's frame.
struct Model {
  Wave wave;
  TransducerArray array;
  Body body;
  Vector3 anchor;  // the point of the body in its own frame that body.place puts on its place [m]
  MeshReport report;
  std::vector<TargetBox> boxes;  // empty without a target
  std::vector<FieldGrid> fields;
};

/// Builds the mesh, the array, the target's boxes and the grids of a scene and checks that they go together.
///
/// throws   InputError on a mesh that is no closed surface, an unknown landmark, a transducer inside the body or nearer
///          than 1 mm to its skin, a target that holds no face or every face, a list of fixed phases that does not fit
///          the channels
Model build_model(const Scene& scene);

/// The mesh that a scene's judge computes on, in the world's frame: the body meshed anew with the judge's edge length
/// and moved as the model's own was, or the model's with every face split in four.
/// throws   InputError as build_model; std::logic_error if the judge has no mesh of its own
TriangleMesh build_judge_mesh(const Scene& scene, const Model& model);

/// The medium of a scene at its frequency.
Medium build_medium(const MediumSpec& spec, double frequency);

/// The target of a scene on its model. A scene that leaves the pressure open (`best`) gets 1 Pa.
/// throws   InputError as make_target; std::logic_error if the scene has no target
Target build_target(const Scene& scene, const Model& model);
/// The same on another mesh of the same body.
Target build_target(const Scene& scene, const Model& model, const TriangleMesh& mesh);

}  // namespace touchfield
