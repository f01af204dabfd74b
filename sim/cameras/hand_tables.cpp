#include "sim/cameras/hand_tables.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/hand/hand_flesh.h"
#include "sim/scene/number_table.h"
#include "sim/scene/quantity.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostRows = 100'000;                   // 18 minutes at 90 a second
constexpr std::size_t kMostBytes = std::size_t{200} << 20U;  // of them, with radii
constexpr double kMostSeconds = 1e10;                        // [s]: more than since 1970

std::string column_of(const std::string& joint, char axis) { return fmt::format("{}_{}", joint, axis); }

schema::TableForm joints_form() {
  const schema::Unit metres = schema::Unit::power_of_ten(0);
  schema::TableForm form{
      .known =
          {{.name = "time_s", .unit = metres, .range = schema::between(-kMostSeconds, kMostSeconds), .required = true}},
      .rows = "frames",
      .names = "time_s, or x, y and z of a joint as OpenXR names it, as wrist_x or index_tip_x, or index_tip_x_mm",
      .most = kMostRows,
      .most_bytes = kMostBytes};
  for (const std::string joint : kOpenXrJoints) {
    const bool tracked = is_tracked(joint);
    for (const char axis : {'x', 'y', 'z'}) {
      form.known.push_back({.name = column_of(joint, axis),
                            .unit = metres,
                            .required = tracked,
                            .length = true,
                            .ignored = !tracked,
                            .gaps = true});
    }
    form.known.push_back({.name = joint + "_radius", .unit = metres, .length = true, .ignored = true});
  }
  return form;
}

/// Those in the world's frame, or none where the tracker had no hand.
std::optional<JointPoints> placed(const JointPoints& joints, const RigidMotion& pose) {
  const bool one_place = (joints.colwise() - joints.col(0)).isZero(0);  // what trackers write for no hand
  if (!joints.allFinite() || one_place) {
    return {};
  }
  return (pose.rotation * joints).colwise() + pose.shift;
}

}  // namespace

JointRecording read_joints(const std::string& path, const RigidMotion& pose) {
  const schema::NumberTable table = schema::read_number_table(path, joints_form());
  schema::require_rising(path, table, "time_s");
  JointRecording recording{table.columns.at("time_s"),
                           std::vector<std::optional<JointPoints>>(table.rows(), JointPoints())};
  Eigen::Index j = 0;
  for (const std::string joint : kOpenXrJoints) {
    for (Eigen::Index axis = 0; is_tracked(joint) && axis < 3; ++axis) {
      const std::vector<double>& values = table.columns.at(column_of(joint, "xyz"[axis]));
      for (std::size_t row = 0; row < values.size(); ++row) {
        (*recording.joints[row])(axis, j) = values[row];
      }
    }
    j += is_tracked(joint) ? 1 : 0;
  }
  for (std::optional<JointPoints>& joints : recording.joints) {
    joints = placed(*joints, pose);
  }
  return recording;
}

std::optional<JointPoints> joints_of_row(std::string_view row, const RigidMotion& pose) {
  constexpr std::size_t kNumbers = 1 + 3 * kOpenXrJoints.size();
  const std::vector<std::string_view> fields = schema::cells(row.substr(0, row.find_first_of("\r\n")));
  require(fields.size() == kNumbers, "{} values, must be {}: time_s, then x, y and z of each joint [m]", fields.size(),
          kNumbers);
  std::vector<double> values;
  for (const std::string_view field : fields) {
    const std::optional<double> value = field.empty() ? std::nan("") : number_of<double>(field);
    require(value, "value {} is '{}', must be a number", values.size() + 1, field);
    values.push_back(*value);
  }
  JointPoints joints;
  Eigen::Index tracked = 0;
  for (std::size_t j = 0; j < kOpenXrJoints.size(); ++j) {
    if (is_tracked(kOpenXrJoints[j])) {
      joints.col(tracked++) = Eigen::Map<const Vector3>(&values[1 + 3 * j]);
    }
  }
  return placed(joints, pose);
}

namespace {

constexpr std::size_t kMostTableBytes = std::size_t{50} << 20U;

std::string coordinate_column(const std::string& landmark, Eigen::Index axis) {
  return fmt::format("{}_{}_mm", landmark, "xyz"[axis]);
}

schema::TableForm landmarks_form() {
  constexpr std::size_t kMostTimes = 10'000;  // as a folder of images has
  schema::TableForm form{.known = {{.name = "time_s", .unit = schema::Unit::power_of_ten(0), .required = true}},
                         .rows = "times",
                         .names = "time_s, or x, y and z of a landmark of the hand, as index_pad_x_mm",
                         .most = kMostTimes,
                         .most_bytes = kMostTableBytes};
  for (const std::string& name : hand_landmark_names()) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      form.known.push_back({.name = coordinate_column(name, axis),
                            .unit = schema::Unit::power_of_ten(-3),
                            .length = true,
                            .gaps = true});
    }
  }
  return form;
}

}  // namespace

std::optional<Points> LandmarkRecording::between(double time) const {
  constexpr double kSame = 1e-4;  // [s]
  const auto after = std::ranges::lower_bound(seconds, time - kSame);
  if (after == seconds.end()) {
    return {};
  }
  const auto row = static_cast<std::size_t>(after - seconds.begin());
  if (*after <= time + kSame) {
    return at[row];
  }
  if (row == 0) {
    return {};
  }
  const double share = (time - seconds[row - 1]) / (seconds[row] - seconds[row - 1]);
  return Points(at[row - 1] + share * (at[row] - at[row - 1]));
}

Points landmark_points(const TriangleMesh& mesh, const std::vector<Landmark>& landmarks,
                       const std::vector<std::string>& names) {
  Points points =
      Points::Constant(3, static_cast<Eigen::Index>(names.size()), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto landmark = std::ranges::find(landmarks, names[i], &Landmark::name);
    if (landmark != landmarks.end()) {
      points.col(static_cast<Eigen::Index>(i)) = position(mesh, *landmark);
    }
  }
  return points;
}

std::string landmarks_csv(const LandmarkRecording& recording) {
  std::string text = "time_s";
  for (const std::string& name : recording.names) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      text += "," + coordinate_column(name, axis);
    }
  }
  text += "\n";
  for (std::size_t row = 0; row < recording.seconds.size(); ++row) {
    text += schema::decimal_text(recording.seconds[row]);
    for (const double coordinate : recording.at[row].reshaped()) {
      text += std::isfinite(coordinate) ? fmt::format(",{:.4f}", coordinate / kMillimetre) : ",";
    }
    text += "\n";
  }
  return text;
}

LandmarkRecording read_landmarks(const std::string& path) {
  const schema::NumberTable table = schema::read_number_table(path, landmarks_form());
  schema::require_rising(path, table, "time_s");
  LandmarkRecording recording;
  recording.seconds = table.columns.at("time_s");
  for (const std::string& name : hand_landmark_names()) {
    int found = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      found += table.has(coordinate_column(name, axis)) ? 1 : 0;
    }
    require(found == 0 || found == 3, "{}: landmark {} must have all of {}, {}, {}", path, name,
            coordinate_column(name, 0), coordinate_column(name, 1), coordinate_column(name, 2));
    if (found == 3) {
      recording.names.push_back(name);
    }
  }
  recording.at.assign(table.rows(), Points(3, static_cast<Eigen::Index>(recording.names.size())));
  for (std::size_t i = 0; i < recording.names.size(); ++i) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const std::vector<double>& values = table.columns.at(coordinate_column(recording.names[i], axis));
      for (std::size_t row = 0; row < values.size(); ++row) {
        recording.at[row](axis, static_cast<Eigen::Index>(i)) = values[row];
      }
    }
  }
  return recording;
}

}  // namespace touchfield
