#include <algorithm>

#include "sim/scene/array_spec.h"

namespace touchfield {

namespace {

struct ChannelCounter {
  Eigen::Index operator()(const GridArray& grid) const { return Eigen::Index{grid.count[0]} * grid.count[1]; }
  Eigen::Index operator()(const Autd3Array& autd3) const {
    const Eigen::Index units = autd3.layout ? Eigen::Index{(*autd3.layout)[0]} * (*autd3.layout)[1]
                                            : static_cast<Eigen::Index>(autd3.units.size());
    return units * autd3_unit(autd3.pitch).positions.cols();
  }
  Eigen::Index operator()(const SonicsurfaceArray&) const { return sonicsurface_layout().positions.cols(); }
  Eigen::Index operator()(const PositionsArray& list) const { return list.points.cols(); }
  Eigen::Index operator()(const PlaneWaveArray&) const { return 1; }
};

bool belongs(ResponseOf in, ResponseOf array) { return in == ResponseOf::kBoth || in == array; }

ChannelResponse response_of(const ArraySpec& spec, ResponseOf array) {
  ChannelResponse response;
  if (spec.calibration && belongs(spec.calibration->in, array)) {
    const auto count = static_cast<Eigen::Index>(spec.calibration->gain.size());
    response = {Eigen::Map<const Eigen::VectorXd>(spec.calibration->gain.data(), count),
                Eigen::Map<const Eigen::VectorXd>(spec.calibration->phase.data(), count)};
  }
  if (spec.tolerances && belongs(spec.tolerances->in, array)) {
    response = product(response, random_response(channel_count(spec), *spec.tolerances, spec.tolerances->seed));
  }
  return response;
}

}  // namespace

Eigen::Index channel_count(const ArraySpec& spec) { return std::visit(ChannelCounter{}, spec.layout); }

ChannelResponses channel_responses(const ArraySpec& spec) {
  return {response_of(spec, ResponseOf::kSolver), response_of(spec, ResponseOf::kTruth)};
}

bool solver_mistakes_channels(const ArraySpec& spec) {
  return (spec.calibration && spec.calibration->in != ResponseOf::kBoth) ||
         (spec.tolerances && spec.tolerances->in != ResponseOf::kBoth) || spec.phase_levels;
}

}  // namespace touchfield
