#include "sim/model/kept_bodies.h"

#include <algorithm>
#include <utility>

namespace touchfield {

bool same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  constexpr double kSamePlace = 1e-9;  // [m]
  return a.vertex_count() == b.vertex_count() && a.face_count() == b.face_count() && a.triangles() == b.triangles() &&
         (a.vertices() - b.vertices()).cwiseAbs().maxCoeff() <= kSamePlace;
}

const TriangleMesh* KeptBodies::like(const TriangleMesh& mesh) const {
  const auto found =
      std::ranges::find_if(entries_, [&](const auto& entry) { return same_mesh(entry.second.meshed.body.mesh, mesh); });
  return found != entries_.end() ? &found->second.meshed.body.mesh : nullptr;
}

const MeshedBody& KeptBodies::get(const std::string& role, const std::string& key,
                                  const std::function<MeshedBody()>& make) {
  const auto found = entries_.find(role);
  if (found != entries_.end() && found->second.key == key) {
    return found->second.meshed;
  }
  MeshedBody meshed = make();  // first, so that a body that cannot be meshed leaves what was kept
  return entries_.insert_or_assign(role, Entry{key, std::move(meshed)}).first->second.meshed;
}

Vector3 KeptBodies::landmark(const std::string& key, const std::function<Vector3()>& find) {
  const auto found = landmarks_.find(key);
  return found != landmarks_.end() ? found->second : landmarks_.emplace(key, find()).first->second;
}

}  // namespace touchfield
