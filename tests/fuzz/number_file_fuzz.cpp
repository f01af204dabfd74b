// Files of numbers that a scene or `compare` names; TOUCHFIELD_FUZZ_READER says which.

#include <algorithm>

#include "sim/scene/number_files.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

namespace {

bool finite(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).allFinite();
}

[[maybe_unused]] void positions(const std::string& path) {
  schema::PositionsFile file;
  if (fuzz::accepts([&] { file = schema::read_positions(path); })) {
    fuzz::require(file.points.cols() > 0 && file.points.allFinite(), "positions are finite");
    fuzz::require(!file.axes || (file.axes->cols() == file.points.cols() && file.axes->allFinite()),
                  "an axis a position");
  }
}

[[maybe_unused]] void phases(const std::string& path) {
  std::vector<double> file;
  if (fuzz::accepts([&] { file = schema::read_phases(path); })) {
    fuzz::require(!file.empty() && finite(file), "a file holds phases, all finite");
  }
}

[[maybe_unused]] void calibration(const std::string& path) {
  constexpr std::size_t kChannels = 4;
  schema::CalibrationFile file;
  if (fuzz::accepts([&] { file = schema::read_calibration(path, kChannels); })) {
    fuzz::require(file.gain.size() == kChannels && file.phase.size() == kChannels, "a row a channel");
    fuzz::require(finite(file.gain) && finite(file.phase), "responses are finite");
    fuzz::require(std::ranges::all_of(file.gain, [](double gain) { return gain >= 0; }), "gains are at least 0");
  }
}

[[maybe_unused]] void measured_points(const std::string& path) {
  MeasuredPoints file;
  if (fuzz::accepts([&] { file = read_measured_points(path); })) {
    const Eigen::Index count = file.points.cols();
    fuzz::require(count > 0 && file.pressure.size() == count && std::ssize(file.lines) == count, "a pressure a point");
    fuzz::require(file.points.allFinite() && file.pressure.allFinite(), "points and pressures are finite");
    fuzz::require(file.complex || (file.pressure.real().array() >= 0).all(), "magnitudes are at least 0");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::TimeLimit limit;
  TOUCHFIELD_FUZZ_READER(fuzz::file_with("numbers", fuzz::text_of(data, size)));
  return 0;
}
