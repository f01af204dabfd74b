#pragma once

#include <string>
#include <vector>

#include <fmt/format.h>

#include "sim/cameras/hand_tables.h"

namespace touchfield {
inline namespace support {

/// A table of tracked joints [m], a frame each period; a frame without joints is an empty row.
inline std::string joint_table_text(const std::vector<std::optional<JointPoints>>& frames, double period,
                                    double begin = 0) {
  std::string text = "time_s";
  for (const std::string joint : kOpenXrJoints) {
    if (joint != "palm" && !joint.ends_with("_metacarpal")) {
      text += fmt::format(",{0}_x,{0}_y,{0}_z", joint);
    }
  }
  text += "\n";
  for (std::size_t k = 0; k < frames.size(); ++k) {
    text += fmt::format("{:.6f}", begin + period * static_cast<double>(k));
    for (Eigen::Index i = 0; i < 3 * kTrackedJoints; ++i) {
      text += frames[k] ? fmt::format(",{:.9f}", frames[k]->reshaped()(i)) : ",";
    }
    text += "\n";
  }
  return text;
}

/// A row of a table without header: the joints that are not used are at the origin.
inline std::string joint_row_text(const JointPoints& joints) {
  std::string text = "0";
  Eigen::Index tracked = 0;
  for (const std::string joint : kOpenXrJoints) {
    const bool used = joint != "palm" && !joint.ends_with("_metacarpal");
    const Vector3 at = used ? Vector3(joints.col(tracked++)) : Vector3::Zero();
    text += fmt::format(",{:.9f},{:.9f},{:.9f}", at.x(), at.y(), at.z());
  }
  return text;
}

}  // namespace support
}  // namespace touchfield
