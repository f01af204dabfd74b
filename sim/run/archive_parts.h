#pragma once

#include <string>
#include <utility>

#include "sim/run/archive_file.h"
#include "sim/run/run_archive.h"

/// What run.h5 and motion.h5 both hold. Io is GroupWriter or GroupReader, and what is written or read a const or a
/// plain reference.
namespace touchfield {

inline void format_parts(const GroupWriter& io, const ArchiveFormat& format) {
  io.attribute("format", format.name());
  io.attribute("format_version", format.version);
}

/// throws   InputError if there is no mesh or no array
inline void require_groups(const GroupReader& io) {
  for (const char* group : {"mesh", "array"}) {
    if (!io.has(group)) {
      io.fail(std::string("holds no group ") + group);
    }
  }
}

inline Choices<SkinExtent> extent_choices() {
  return {{to_string(SkinExtent::kWhole), SkinExtent::kWhole}, {to_string(SkinExtent::kPart), SkinExtent::kPart}};
}

/// Result: a Run or a Motion.
template <class Io, class Result>
void extent_parts(const Io& io, Result& result) {
  io.choice("solved_skin", result.solved_skin, extent_choices());
}

inline Choices<PhaseStatus> status_choices() {
  Choices<PhaseStatus> choices;
  for (const PhaseStatus status :
       {PhaseStatus::kConverged, PhaseStatus::kIterationLimit, PhaseStatus::kStalled, PhaseStatus::kDirect}) {
    choices.emplace_back(to_string(status), status);
  }
  return choices;
}

inline void mesh_parts(const GroupWriter& io, const TriangleMesh& mesh) {
  io.columns("vertices", mesh.vertices(), "m");
  io.columns("triangles", mesh.triangles(), "1");
  io.list("area", mesh.areas(), "m2");
}

inline TriangleMesh read_mesh(const GroupReader& io) {
  Points vertices;
  Triangles triangles;
  io.columns("vertices", vertices, "m");
  io.columns("triangles", triangles, "1");
  try {
    return {std::move(vertices), std::move(triangles)};
  } catch (const InputError& error) {
    io.fail(error.what());
  }
}

inline void directivity_parts(const GroupWriter& io, const Directivity& directivity) {
  io.attribute("directivity", directivity_name(directivity.kind()));
  if (directivity.kind() == Directivity::Kind::kPiston) {
    io.attribute("directivity_ka", directivity.ka());
  }
}

inline void directivity_parts(const GroupReader& io, Directivity& directivity) {
  std::string name;
  io.attribute("directivity", name);
  if (name == directivity_name(Directivity::Kind::kOmni)) {
    directivity = Directivity::omni();
  } else if (name == directivity_name(Directivity::Kind::kT4010a1)) {
    directivity = Directivity::t4010a1();
  } else if (name == directivity_name(Directivity::Kind::kPiston)) {
    double ka = 0.0;
    io.attribute("directivity_ka", ka);
    if (!(ka > 0)) {
      io.fail("directivity_ka = " + std::to_string(ka) + " must be > 0");
    }
    directivity = Directivity::piston(ka, 1.0);
  } else {
    io.fail("unknown directivity '" + name + "'");
  }
}

template <class Io, class Response>
void response_parts(const Io& io, Response& response) {
  io.optional_list("gain", response.gain, "1");
  io.optional_list("phase", response.phase, "rad");
}

template <class Io, class Array>
void array_parts(const Io& io, Array& array) {
  io.choice("kind", array.kind,
            {{"transducers", TransducerArray::Kind::kTransducers}, {"plane_wave", TransducerArray::Kind::kPlaneWave}});
  directivity_parts(io, array.directivity);
  io.columns("position", array.positions, "m");
  io.columns("axis", array.axes, "1");
  io.list("amplitude", array.amplitudes, array.kind == TransducerArray::Kind::kPlaneWave ? "Pa" : "Pa m");
  io.list("device", array.device, "1");
  io.list("channel", array.channel, "1");
  response_parts(io, array.response);
}

}  // namespace touchfield
