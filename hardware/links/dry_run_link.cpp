#include "hardware/links/dry_run_link.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

constexpr double kFramesPerSecond = 1e6;  // it takes what comes
constexpr double kModulationRate = 4000;  // as of the device that has a buffer
constexpr std::size_t kModulationSamples = 32768;

std::string frame_text(const DriveFrame& frame, const DriveSteps& steps) {
  std::string text =
      fmt::format("# drives of {} transducers; phase [rad]  # phase step of {}, intensity step of 0..{}\n",
                  frame.size(), steps.phase_levels, steps.intensity_levels - 1);
  const Eigen::VectorXd phases = phases_of(frame, steps);
  for (std::size_t n = 0; n < frame.size(); ++n) {
    fmt::format_to(std::back_inserter(text), "{:.15f}  # {} {}\n", phases(static_cast<Eigen::Index>(n)), frame.phase[n],
                   frame.intensity[n]);
  }
  return text;
}

}  // namespace

DryRunLink::DryRunLink(ArrayLayout array, std::string file, int phase_levels, bool sequence)
    : array_(std::move(array)),
      file_(std::move(file)),
      phase_levels_(phase_levels),
      sequence_(sequence),
      last_(quiet_frame(static_cast<std::size_t>(array_.positions.cols()))) {}

std::string DryRunLink::describe() const {
  return fmt::format("dry run of {} transducers{}", array_.positions.cols(), file_.empty() ? "" : " to " + file_);
}

LinkAbilities DryRunLink::abilities() const {
  return {{phase_levels_, 256}, kFramesPerSecond, {kModulationRate, kModulationSamples, {}}, true};
}

void DryRunLink::set_modulation(const Modulation& modulation) {
  modulation_ = modulation_samples(modulation, abilities().modulation);
}

void DryRunLink::send(const DriveFrame& frame) {
  require_fits(frame, abilities(), static_cast<std::size_t>(array_.positions.cols()), describe());
  if (!file_.empty()) {
    const std::string path = next_file();
    std::ofstream out(path, std::ios::binary);
    out << frame_text(frame, abilities().steps);
    out.close();
    if (!out) {
      throw IoError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
    }
  }
  last_ = frame;
}

std::string DryRunLink::next_file() {
  ++written_;
  if (!sequence_) {
    return file_;
  }
  const std::filesystem::path path(file_);
  return (path.parent_path() / fmt::format("{}-{:04}{}", path.stem().string(), written_, path.extension().string()))
      .string();
}

}  // namespace touchfield
