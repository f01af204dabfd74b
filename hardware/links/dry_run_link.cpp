#include "hardware/links/dry_run_link.h"

#include <filesystem>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "sim/core/files.h"

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

std::string DryRunFiles::of(std::size_t frame) const {
  if (frames == 1) {
    return file;
  }
  const std::filesystem::path path(file);
  return (path.parent_path() / fmt::format("{}-{:04}{}", path.stem().string(), frame + 1, path.extension().string()))
      .string();
}

DryRunLink::DryRunLink(ArrayLayout array, int phase_levels, DryRunFiles files)
    : array_(std::move(array)), phase_levels_(phase_levels), files_(std::move(files)) {}

std::string DryRunLink::describe() const {
  return fmt::format("dry run of {} transducers{}", array_.positions.cols(),
                     files_.file.empty() ? "" : " to " + files_.file);
}

LinkAbilities DryRunLink::abilities() const {
  return {{phase_levels_, 256}, kFramesPerSecond, {kModulationRate, kModulationSamples, {}}};
}

void DryRunLink::open() {
  if (files_.file.empty()) {
    return;
  }
  for (std::size_t frame = 0; frame < files_.frames; ++frame) {
    require_free(files_.of(frame), files_.replace, "--force replaces it");
  }
}

void DryRunLink::set_modulation(const Modulation& modulation) {
  require_ability(modulation, abilities().modulation, describe());
}

void DryRunLink::send(const DriveFrame& frame) {
  require_fits(frame, abilities(), static_cast<std::size_t>(array_.positions.cols()), describe());
  if (!files_.file.empty()) {
    write_atomically(files_.of(written_++), {frame_text(frame, abilities().steps)});
  }
}

}  // namespace touchfield
