#include "sim/scene/camera_models.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kDisparities = 126;  // [pixels]

}  // namespace

const std::vector<CameraModel>& camera_models() {
  static const std::vector<CameraModel> models{{"d415", 65 * kDegree, 55e-3, kDisparities},
                                               {"d435", 87 * kDegree, 50e-3, kDisparities},
                                               {"d405", 87 * kDegree, 18e-3, kDisparities}};
  return models;
}

const CameraModel& camera_model(const std::string& name) {
  const auto model = std::ranges::find(camera_models(), name, &CameraModel::name);
  if (model == camera_models().end()) {
    std::vector<std::string> names;
    for (const CameraModel& known : camera_models()) {
      names.push_back(known.name);
    }
    throw InputError(fmt::format("camera {} is not known: {}", name, fmt::join(names, ", ")));
  }
  return *model;
}

}  // namespace touchfield
