#include "sim/motion/whole_skin.h"

#include <algorithm>

namespace touchfield {

namespace {

MovingSkin whole_skin_of(const Model& first, KeptBodies* kept) {
  const Scene& scene = first.fixed->scene;
  const bool series = std::ranges::any_of(scene.bodies, [](const BodySpec& body) {
    const auto* shape = std::get_if<MeshShape>(&body.shape);
    return shape != nullptr && shape->series;
  });
  EdgeSpec edge;
  edge.far = WholeSkin::kFar;
  edge.within = WholeSkin::kWithin;
  if (scene.target) {
    edge.near_target = WholeSkin::kNearTarget;
  }
  const PlacedBodies whole = build_bodies(scene, first.plan, {series ? nullptr : &edge}, Extent::kWhole, kept);
  return {scene, first.plan, whole.body.mesh, whole.owner};
}

}  // namespace

WholeSkin::WholeSkin(const Model& first, KeptBodies* kept) : skin_(whole_skin_of(first, kept)) {}

}  // namespace touchfield
