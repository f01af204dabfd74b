#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/hand/body.h"
#include "sim/scene/scene.h"

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

/// What messages call a body of a scene: "body", "bodies: left".
std::string called(const BodySpec& spec);

/// Refuses a file with a unit that is not given and not certain, or is a slip, and edges that are too long for the
/// body's size. This comes before any work that grows with these. Adds a warning about a doubtful unit.
///
/// body     of a mesh file
/// throws   InputError
void check_unit(const BodySpec& body, std::vector<std::string>& warnings);

/// A landmark that a scene gives for a mesh file.
struct GivenLandmark {
  std::string name;
  double off = 0;    // distance from the skin [m]
  std::string text;  // key, place, distance and the nearest point of the skin, in the file's unit
};

/// How far a body's landmarks are from its skin: they are put on the nearest point of it.
///
/// body     of a mesh file
/// skin     in the file's frame [m]
/// throws   InputError if one is kMostLandmarkOff from it or farther
std::vector<GivenLandmark> given_landmarks(const BodySpec& body, const TriangleMesh& skin);

inline constexpr double kNotedLandmarkOff = 3e-3;  // [m]
inline constexpr double kMostLandmarkOff = 15e-3;  // [m]

/// body     of a mesh file
/// throws   InputError if a mesh file is not the closed surface of a body and cannot be resurfaced to one, or its unit
///          is not given and not surely mm
void require_body(const BodySpec& body);

/// The body of a mesh file in its own frame: its faces, mended where they have no area, or resurfaced if the scene asks
/// for it.
///
/// kept    where bodies of files are kept; may be null
/// notes   set to what was done to the file's faces; may be null
/// throws  InputError if it is not the closed surface of a body, cannot be resurfaced to one, or loses a landmark; as
///         given_landmarks
Body body_from_file(const BodySpec& spec, KeptBodies* kept, std::vector<std::string>* notes = nullptr);

/// The mask of a target on a body, in the body's own frame.
struct MaskedPart {
  TargetBox box;
  std::vector<Vector3> places;  // all over it [m]
};

/// body     of a mesh file
/// throws   InputError if the body has no mesh file or several, or the file not as many faces as the mask has levels
MaskedPart masked_part(const BodySpec& spec, const TargetMaskSpec& mask);

/// A body in its own frame with faces of one size [m], or those of its file.
Body plain_body(const BodySpec& spec, double edge, KeptBodies* kept);

/// A body in its own frame as a scene asks for it.
///
/// edge     null: the faces of its file
/// sizing   of `edge`; not null where that is graded
Body meshed(const BodySpec& spec, const EdgeSpec* edge, const EdgeSizing* sizing, KeptBodies* kept);

/// The landmarks of a body on another mesh of it, without those that lie off it.
std::vector<Landmark> carried_over(const Body& from, const TriangleMesh& to);

HandOptions hand_options(const HandShape& shape, double edge);

/// Length and time of a file: what a mesh made of it follows from.
std::string file_state(const std::string& file);

}  // namespace touchfield
