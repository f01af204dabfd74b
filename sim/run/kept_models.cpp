#include "sim/run/kept_models.h"

#include <utility>

namespace touchfield {

namespace {

bool same_wave(const Wave& a, const Wave& b) {
  return a.frequency() == b.frequency() && a.medium().sound_speed == b.medium().sound_speed &&
         a.medium().density == b.medium().density && a.medium().absorption == b.medium().absorption;
}

}  // namespace

std::shared_ptr<SkinModel> KeptModels::get(const std::string& role, const TriangleMesh& mesh, const Wave& wave,
                                           Scheme scheme, const SolverSpec& spec, Eigen::Index right_hand_sides) {
  const auto found = entries_.find(role);
  if (found != entries_.end()) {
    const ScatteringSystem& system = found->second.model->system();
    if (system.scheme() == scheme && found->second.spec == spec && same_wave(system.wave(), wave)) {
      if (same_mesh(system.mesh(), mesh)) {
        return found->second.model;
      }
      if (found->second.model.use_count() == 1 && found->second.model->follow(mesh)) {
        return found->second.model;
      }
    }
    entries_.erase(found);  // before the next one takes its memory
  }
  const TriangleMesh* exact = bodies_ != nullptr ? bodies_->like(mesh) : nullptr;
  auto model =
      std::make_shared<SkinModel>(exact != nullptr ? *exact : mesh, wave, scheme, spec, scenes_ * right_hand_sides);
  entries_.emplace(role, Entry{spec, model});
  return model;
}

std::unique_ptr<SkinScattering> make_scattering(const std::string& role, const TriangleMesh& mesh, Scheme scheme,
                                                const SolverSpec& spec, Eigen::Index right_hand_sides,
                                                const Model& model, const ChannelResponse& response, KeptModels* kept,
                                                std::vector<SolveRecord>& records, Progress& progress) {
  TransducerArray array = model.fixed->array;
  array.response = response;
  if (kept == nullptr || model.fixed->array.kind != TransducerArray::Kind::kTransducers) {
    return std::make_unique<SkinScattering>(mesh, model.fixed->wave, scheme, spec, std::move(array), records, progress,
                                            right_hand_sides);
  }
  const TriangleMesh own(model.own_frame(mesh.vertices()), mesh.triangles());
  return std::make_unique<SkinScattering>(kept->get(role, own, model.fixed->wave, scheme, spec, right_hand_sides),
                                          moved(array, model.own_frame), records, progress);
}

}  // namespace touchfield
