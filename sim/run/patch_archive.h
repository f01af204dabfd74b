#pragma once

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "sim/core/require.h"
#include "sim/mesh/topology.h"
#include "sim/run/motion_data.h"
#include "sim/run/run_archive.h"

/// The patch of a pattern in pattern.h5.
namespace touchfield {

/// throws   InputError if its parts do not fit each other or so many frames
inline void check_patch(const MotionPatch& patch, Eigen::Index frames) {
  require(patch.radiation.rows() == patch.skin.size() && patch.radiation.cols() == frames &&
              patch.radiation.allFinite() && patch.rate > 0,
          "patch: radiation must be numbers, of its faces and of the first method's frames, and frames_per_second > 0");
  std::set<std::string> points;
  for (const auto& [name, at] : patch.points) {
    require_name("patch: point", name, points);
  }
}

inline void patch_parts(const GroupWriter& io, const Motion& motion) {
  const MotionPatch& patch = *motion.patch;
  std::vector<std::string> names;
  std::vector<Vector3> places;
  for (const auto& [name, place] : patch.points) {
    names.push_back(name);
    places.push_back(place);
  }
  io.attribute("frames_per_second", patch.rate);
  io.attribute("middle", static_cast<int>(patch.skin.face));
  io.attribute("points", names);
  io.columns("points", as_columns(places), "m");
  io.list("faces", patch.skin.faces, "1");
  io.write_compact("radiation", patch.radiation.data(),
                   {static_cast<std::uint64_t>(patch.radiation.cols()), static_cast<std::uint64_t>(patch.skin.size())},
                   "Pa");
}

/// The patch is made again of the mesh.
inline void patch_parts(const GroupReader& io, Motion& motion) {
  MotionPatch patch;
  int face = 0;
  std::vector<std::string> names;
  Points places;
  io.attribute("frames_per_second", patch.rate);
  io.attribute("middle", face);
  io.attribute("points", names);
  io.columns("points", places, "m");
  if (places.cols() != std::ssize(names) || face < 0 || face >= evaluated_mesh(motion).face_count()) {
    io.fail("middle must be a face, and points as many as their names");
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    patch.points.emplace_back(names[i], places.col(static_cast<Eigen::Index>(i)));
  }
  patch.skin = skin_patch(evaluated_mesh(motion), face);
  Eigen::Matrix<std::int64_t, Eigen::Dynamic, 1> faces;
  io.list("faces", faces, "1");
  if (!std::ranges::equal(faces, patch.skin.faces)) {
    io.fail("faces must be those about the middle");
  }
  if (motion.methods.empty()) {
    io.fail("there must be a method");
  }
  const std::uint64_t frames = motion.methods.front().frames.size();
  patch.radiation.resize(patch.skin.size(), static_cast<Eigen::Index>(frames));
  io.read("radiation", {frames, static_cast<std::uint64_t>(patch.skin.size())}, patch.radiation.data());
  motion.patch = std::move(patch);
}

}  // namespace touchfield
