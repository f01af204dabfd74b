#include "apps/commands/device_options.h"

#include <algorithm>

#include "apps/commands/command_line.h"
#include "sim/core/require.h"
#include "sim/core/text_number.h"
#include "sim/core/whole_file.h"
#include "sim/scene/text_file.h"

namespace touchfield {

namespace {

// Numbers 0..255 between blanks, line ends or commas.
std::vector<std::uint8_t> read_samples(const std::string& path) {
  std::string text = read_text_file(path, schema::kMostTextBytes);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<std::uint8_t> samples;
  constexpr const char* kBlanks = " \t\r\n";
  for (std::size_t at = text.find_first_not_of(kBlanks); at != std::string::npos;
       at = text.find_first_not_of(kBlanks, at)) {
    const std::size_t end = std::min(text.find_first_of(kBlanks, at), text.size());
    const std::string word = text.substr(at, end - at);
    const auto sample = number_of<std::uint8_t>(word);
    require(sample, "{}: sample {} is '{}', it must be a whole number from 0 to 255", path, samples.size() + 1, word);
    samples.push_back(*sample);
    at = end;
  }
  return samples;
}

}  // namespace

void add_device(CLI::App* command, DeviceOptions& options) {
  command
      ->add_option("--to", options.device.link,
                   "Link to the array: dry-run, dry-run:FILE, sonicsurface:PORT, autd3-udp, ...; `touchfield array "
                   "list` shows all")
      ->type_name("LINK")
      ->capture_default_str();
}

void add_emission(CLI::App* command, DeviceOptions& options) {
  command->add_flag("--emit", options.emit, "Emit sound; without it everything else is done");
  const schema::Range share = schema::above_to(0, 1);
  add_number(command, "--level", options.request.level, share,
             "Level that stands for full amplitude; default: 0.5, or 1 if the device has no other level");
  add_number(command, "--max-level", options.request.most_level, share, "Cap on the level");
  add_number(command, "--max-seconds", options.request.most_seconds, schema::above(0),
             "Cap on the time of emission [s]");
  auto* modulation = add_number(command, "--modulation", options.device.frequency, schema::above(0),
                                "Modulate the amplitude by a sine of this frequency [Hz]");
  add_number(command, "--depth", options.device.depth, share, "Depth of the modulation")->needs(modulation);
  command
      ->add_option("--modulation-samples", options.samples,
                   "File of modulation samples 0..255, repeated at the device's own rate")
      ->excludes(modulation)
      ->type_name(kAnyFile);
  command->add_flag("--force", options.device.replace, "Replace existing files of a dry run");
}

EmissionPlan plan_of(const DeviceOptions& options) {
  EmissionPlan plan;
  plan.device = options.device;
  if (!options.samples.empty()) {
    plan.device.samples = read_samples(options.samples);
    plan.read.push_back(options.samples);
  }
  plan.request = options.request;
  plan.emit = options.emit;
  plan.guard = guard_command();
  return plan;
}

}  // namespace touchfield
