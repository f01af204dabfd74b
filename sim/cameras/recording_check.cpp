#include "sim/cameras/recording_check.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kLeastApart = 1e-3;    // of two cameras [m]: none is so small
constexpr double kAtOrigin = 3e-3;      // of all of them [m]
constexpr double kLeastPeriod = 1e-3;   // [s]: depth cameras take up to 300 images per second
constexpr double kMostPeriod = 0.5;     // [s]
constexpr double kOffMiddle = 0.25;     // of the image's size
constexpr double kMostOblong = 1.25;    // of a pixel, the longer side by the shorter one
constexpr double kMiddleOfPixel = 0.5;  // of the upper left one, where the file's columns and rows are 0

void warn_of_places(const std::vector<DepthCamera>& cameras, std::vector<std::string>& warnings) {
  double farthest = 0;
  for (const DepthCamera& camera : cameras) {
    farthest = std::max(farthest, camera.view.eye.norm());
  }
  if (farthest > 0 && farthest < kAtOrigin) {
    warnings.push_back(fmt::format(
        "cameras: {} within {:.2g} mm of the world's origin; if translation_mm holds metres, write millimetres",
        cameras.size() == 1 ? "the camera stands" : "all stand", std::ceil(10 * farthest / kMillimetre) / 10));
    return;
  }
  for (std::size_t c = 1; c < cameras.size(); ++c) {
    for (std::size_t d = 0; d < c; ++d) {
      const double apart = (cameras[c].view.eye - cameras[d].view.eye).norm();
      if (apart < kLeastApart) {
        warnings.push_back(fmt::format(
            "cameras: {} and {} stand {:.2g} mm apart, both at {}; their translation_mm must say where each one is",
            cameras[d].name, cameras[c].name, apart / kMillimetre, place_text(cameras[c].view.eye, 1)));
        return;
      }
    }
  }
}

void warn_of_view(const DepthCamera& camera, std::vector<std::string>& warnings) {
  const Camera& view = camera.view;
  const Eigen::Vector2d size(view.width, view.height);
  const Eigen::Vector2d off = (view.centre.cwiseQuotient(size).array() - 0.5).cwiseAbs();
  if (off.maxCoeff() > kOffMiddle) {
    warnings.push_back(fmt::format(
        "cameras: the axis of {} is at ({:g}, {:g}) in an image of {} x {}, far from its middle; are cx and "
        "cy those of this resolution?",
        camera.name, view.centre.x() - kMiddleOfPixel, view.centre.y() - kMiddleOfPixel, view.width, view.height));
  }
  const double oblong = view.focal.maxCoeff() / view.focal.minCoeff();
  if (oblong > kMostOblong) {
    warnings.push_back(
        fmt::format("cameras: fx = {:g} and fy = {:g} of {} differ by a factor of {:.2g}, and pixels are mostly "
                    "square; are both of "
                    "this resolution?",
                    view.focal.x(), view.focal.y(), camera.name, oblong));
  }
}

void warn_of_times(const std::vector<double>& seconds, std::vector<std::string>& warnings) {
  std::vector<double> periods;
  for (std::size_t k = 1; k < seconds.size(); ++k) {
    periods.push_back(seconds[k] - seconds[k - 1]);
  }
  if (periods.empty()) {
    return;
  }
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  if (*middle > kMostPeriod) {
    warnings.push_back(fmt::format(
        "times: the images are {:.3g} s apart (median), too far to follow a hand; if time_s holds ms, us or numbers of "
        "frames, write seconds",
        *middle));
  } else if (*middle < kLeastPeriod) {
    warnings.push_back(fmt::format(
        "times: the images are {:.3g} s apart (median), which no depth camera is; time_s must be seconds", *middle));
  }
}

}  // namespace

std::vector<std::string> recording_warnings(const std::vector<DepthCamera>& cameras,
                                            const std::vector<double>& seconds) {
  std::vector<std::string> warnings;
  warn_of_places(cameras, warnings);
  for (const DepthCamera& camera : cameras) {
    warn_of_view(camera, warnings);
  }
  warn_of_times(seconds, warnings);
  return warnings;
}

}  // namespace touchfield
