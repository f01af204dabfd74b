#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/hand/body.h"

namespace touchfield {

/// A body meshed in its own frame.
struct MeshedBody {
  Body body;
  std::vector<unsigned char> skin;      // M: 0 on and near the caps of keep_within, else 1; empty: all lies beyond it
  std::vector<std::string> notes;       // what was done to the faces of its file, a line each
  std::optional<TriangleMesh> whole{};  // before keep_within cut it, if it did
};

/// Whether two meshes have the same triangles and nowhere differ by more than 1 nm, a ten-millionth of a wavelength.
bool same_mesh(const TriangleMesh& a, const TriangleMesh& b);

/// Meshes that scenes computed one after another share: of each role, a body of the solver's or of the evaluation's,
/// the last one is kept. A body that only stands elsewhere is then the same mesh to the last bit.
class KeptBodies {
 public:
  /// role   what the mesh is for in a scene, e.g. "evaluation 0"
  /// key    all that the mesh follows from
  /// make   is called if the role's last mesh had another key
  const MeshedBody& get(const std::string& role, const std::string& key, const std::function<MeshedBody()>& make);

  /// The mesh with these triangles that nowhere differs by more than 1 nm: what was placed and moved back has lost the
  /// last bits. Null if none is kept.
  const TriangleMesh* like(const TriangleMesh& mesh) const;

  /// A landmark in a body's own frame, which takes the whole skin of a hand to find.
  ///
  /// key   the body's shape and the landmark's name
  Vector3 landmark(const std::string& key, const std::function<Vector3()>& find);

 private:
  struct Entry {
    std::string key;
    MeshedBody meshed;
  };
  std::map<std::string, Entry> entries_;
  std::map<std::string, Vector3> landmarks_;
};

}  // namespace touchfield
