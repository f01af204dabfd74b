#include "sim/solve/kept_bodies.h"

#include <utility>

namespace touchfield {

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
