#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim/model/kept_bodies.h"
#include "sim/model/model.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

/// Scattering models that scenes computed one after another share, each with the factorisation it has made. A model is
/// the same if scheme, medium, frequency and solver are and the meshes have the same triangles and nowhere differ by
/// more than 1 nm. On a graphics card a model that nobody holds follows a mesh of the same triangles. Of each role the
/// last model is kept, so that no more is held than one scene needs.
class KeptModels {
 public:
  /// bodies   of the same scenes: a model is made of their meshes, so that it is the same to the last bit whichever
  ///          scene is first; may be null; outlive this
  explicit KeptModels(const KeptBodies* bodies = nullptr) : bodies_(bodies) {}

  /// How many scenes are expected to share a model that is made from here on: a factorisation pays earlier.
  void expect(int scenes) { scenes_ = scenes; }
  bool shared() const { return scenes_ > 1; }

  /// The model of a role, of a mesh in a frame that does not move with the scene; made if the last one is another.
  ///
  /// role               what the model is for in a scene, e.g. "evaluation"
  /// right_hand_sides   of the largest block that a scene will ask for
  std::shared_ptr<SkinModel> get(const std::string& role, const TriangleMesh& mesh, const Wave& wave, Scheme scheme,
                                 const SolverSpec& spec, Eigen::Index right_hand_sides);

 private:
  struct Entry {
    SolverSpec spec;
    std::shared_ptr<SkinModel> model;
  };

  const KeptBodies* bodies_;
  int scenes_ = 1;
  std::map<std::string, Entry> entries_;
};

/// A body of a scene in a scheme with the scene's array. Where models are kept it is set up in the first body's own
/// frame, in which a scene that only moves has the same mesh.
///
/// response   of the array's channels
/// kept       may be null
/// records    as SkinScattering's
std::unique_ptr<SkinScattering> make_scattering(const std::string& role, const TriangleMesh& mesh, Scheme scheme,
                                                const SolverSpec& spec, Eigen::Index right_hand_sides,
                                                const Model& model, const ChannelResponse& response, KeptModels* kept,
                                                std::vector<SolveRecord>& records, Progress& progress);

}  // namespace touchfield
