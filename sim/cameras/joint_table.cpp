#include "sim/cameras/joint_table.h"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/scene/number_table.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostRows = 100'000;                   // 18 minutes at 90 a second
constexpr std::size_t kMostBytes = std::size_t{200} << 20U;  // of them, with radii
constexpr double kMostSeconds = 1e10;                        // [s]: more than since 1970

bool is_tracked(std::string_view joint) { return joint != "palm" && !joint.ends_with("_metacarpal"); }

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
  if (fields.size() != kNumbers) {
    throw InputError(
        fmt::format("{} values, must be {}: time_s, then x, y and z of each joint [m]", fields.size(), kNumbers));
  }
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

}  // namespace touchfield
