#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/device_options.h"
#include "apps/commands/standard_streams.h"
#include "hardware/link_address.h"
#include "sim/acoustics/incident_field.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/run/archive_file.h"
#include "sim/run/motion_file.h"
#include "sim/run/run_file.h"

namespace touchfield {

namespace {

struct ArrayCommand {
  DeviceOptions options;
  std::string run;                                         // whose array the device is; empty: what the link says
  std::vector<double> at_mm = {0, 0, 150};                 // of the test's focus, in the array's frame
  double temperature_c = kRoomTemperature - kZeroCelsius;  // of the air, for the focus
  int first = 0;                                           // transducer of the walk
  std::optional<int> count;                                // of the walk; default: to the last
  double dwell = 0.5;                                      // on each transducer of the walk [s]
};

constexpr double kFrequency = 40e3;  // [Hz] of every array there is a link for
constexpr double kNearest = 10e-3;   // of a focus to a transducer [m]
constexpr double kFarthest = 10;     // [m]: far beyond where such a focus can be heard
constexpr const char* kLinks[][2] = {
    {"dry-run[:FILE][?levels=N]", "no device: rounds, reports and writes the phases"},
    {"sonicsurface:PORT[?firmware=primary|secondary|tactile&order=fpga|natural]", "16 x 16 at 10.5 mm, a serial port"},
    {"autd3-udp", "AUTD3 units, firmware 0.10 to 0.12, on the network interface where they answer"},
    {"autd3-udp:INTERFACE", "the same on a network interface, e.g. eth0"},
    {"autd3-udp:HOST:PORT", "the same at an IPv6 address: the vendor's emulator"}};

std::vector<std::string> serial_ports() {
  std::vector<std::string> ports;
  const auto collect = [&](const char* folder, const std::vector<std::string>& beginnings) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      const std::string name = entry.path().filename().string();
      if (std::any_of(beginnings.begin(), beginnings.end(),
                      [&](const std::string& beginning) { return name.starts_with(beginning); })) {
        ports.push_back(entry.path().string());
      }
    }
  };
  collect("/dev/serial/by-id", {""});
  collect("/dev", {"ttyUSB", "ttyACM"});
  std::sort(ports.begin(), ports.end());
  return ports;
}

std::optional<TransducerArray> array_of(const std::string& path) {
  if (path.empty()) {
    return std::nullopt;
  }
  return read_run_file(run_file_at(path)).array;
}

EmissionPlan plan_of(const ArrayCommand& command) {
  EmissionPlan plan = plan_of(command.options);
  if (const auto array = array_of(command.run)) {
    plan.array = layout_of(*array);
    plan.must_match.push_back(*array);
    plan.read.push_back(run_file_at(command.run));
  }
  return plan;
}

// Every transducer in phase at one point.
Drive focus(const ArrayLayout& layout, const Vector3& at, const Wave& wave) {
  for (Eigen::Index n = 0; n < layout.positions.cols(); ++n) {
    const double distance = (layout.positions.col(n) - at).norm();
    require(distance >= kNearest && distance <= kFarthest,
            "--at-mm: {:.1f} mm from transducer {}, must be >= {:g} and <= {:g} mm", distance / kMillimetre, n,
            kNearest / kMillimetre, kFarthest / kMillimetre);
  }
  const TransducerArray array = make_array(layout, Directivity::omni(), 1, 1);
  const Eigen::RowVectorXcd arriving = incident_matrix(array, wave, at);
  return {-arriving.transpose().array().arg().matrix(), Eigen::VectorXd::Ones(layout.positions.cols())};
}

Json device_value(const ArrayCommand& command) {
  const auto array = array_of(command.run);
  const std::unique_ptr<ArrayLink> link = local_link(command.options.device, array ? layout_of(*array) : ArrayLayout{});
  const LinkAbilities abilities = link->abilities();
  const ArrayLayout& layout = link->layout();
  return {{"device", link->describe()},
          {"transducers", layout.positions.cols()},
          {"units", layout.device.maxCoeff() + 1},
          {"phase_levels", abilities.steps.phase_levels},
          {"intensity_levels", abilities.steps.intensity_levels},
          {"frames_per_second", abilities.most_frames_per_second},
          {"modulation_samples_per_second", abilities.modulation.rate},
          {"own_modulation_hz", abilities.modulation.own_frequencies}};
}

int list(const ArrayCommand& command, const CommonFlags& flags) {
  if (command.options.device.link != DeviceChoice{}.link) {
    print_value(device_value(command), flags);
    return 0;
  }
  Json links = Json::array();
  for (const auto& [form, what] : kLinks) {
    links.push_back(Json{{"link", form}, {"what", what}});
  }
  const std::vector<std::string> ports = serial_ports();
  print_value({{"links", links}, {"serial_ports", ports.empty() && !flags.json ? Json("none") : Json(ports)}}, flags);
  return 0;
}

/// What a dry run stands for is the array of a run.
void require_device(const ArrayCommand& command, const char* action) {
  if (command.run.empty() && parse_link_address(command.options.device.link).kind == LinkAddress::Kind::kDryRun) {
    throw InputError(fmt::format(
        "array {} needs a device: add --to sonicsurface:PORT or --to autd3-udp, or --run RUN to try it without one",
        action));
  }
}

int off(const ArrayCommand& command, const CommonFlags& flags) {
  require_device(command, "off");
  const auto array = array_of(command.run);
  const std::unique_ptr<ArrayLink> link = local_link(command.options.device, array ? layout_of(*array) : ArrayLayout{});
  link->open();
  link->silence();
  link->close();
  print_value({{"device", link->describe()}, {"off", true}}, flags);
  return 0;
}

int test(const ArrayCommand& command, const CommonFlags& flags) {
  require_device(command, "test");
  EmissionPlan plan = plan_of(command);
  const Vector3 at = Eigen::Map<const Vector3>(command.at_mm.data()) * kMillimetre;
  const Wave wave(air(command.temperature_c + kZeroCelsius), kFrequency);
  plan.drives = [&](const ArrayLayout& layout) { return std::vector<Drive>{focus(layout, at, wave)}; };
  return print_emission(emit(plan), flags, {{"focus_mm", command.at_mm}});
}

int walk(const ArrayCommand& command, const CommonFlags& flags) {
  require_device(command, "walk");
  EmissionPlan plan = plan_of(command);
  plan.request.rate = 1 / command.dwell;
  ArrayLayout layout;
  plan.drives = [&](const ArrayLayout& device) {
    layout = device;
    const auto n = static_cast<long>(device.positions.cols());
    const long count = command.count ? *command.count : n - command.first;
    if (command.first >= n || count > n - command.first) {
      throw InputError(
          fmt::format("--first = {}, --count = {}: the device has transducers 0 to {}", command.first, count, n - 1));
    }
    std::vector<Drive> drives;
    for (long k = 0; k < count; ++k) {
      drives.push_back({Eigen::VectorXd::Zero(n), Eigen::VectorXd::Unit(n, command.first + k)});
    }
    return drives;
  };
  const bool lines = !flags.json && !flags.quiet;
  plan.observer = [&](std::size_t k, const DriveFrame&) {
    const auto n = static_cast<Eigen::Index>(k) + command.first;
    if (lines) {
      put(fmt::format("transducer {}: unit {} channel {} at ({:.2f}, {:.2f}, {:.2f}) mm\n", n, layout.device(n),
                      layout.channel(n), layout.positions(0, n) / kMillimetre, layout.positions(1, n) / kMillimetre,
                      layout.positions(2, n) / kMillimetre));
      std::fflush(stdout);
    }
  };
  return print_emission(emit(plan), flags);
}

struct SendCommand {
  DeviceOptions options;
  std::vector<std::string> runs;  // run.h5, motion.h5 or their directory, in the order of the sequence
  std::string method;             // empty: the runs' only one
  bool rate_given = false;
};

/// Frames per second of a motion.
/// throws   InputError unless they follow each other evenly, to 1 %
double frame_rate(const std::vector<MotionFrame>& frames, const std::string& path) {
  const double rate = static_cast<double>(frames.size() - 1) / (frames.back().shown - frames.front().shown);
  for (std::size_t k = 1; k < frames.size(); ++k) {
    require(std::abs((frames[k].shown - frames[k - 1].shown) * rate - 1.0) < 0.01,
            "{}: its frames do not follow each other evenly; --rate says how many are sent per second", path);
  }
  return rate;
}

/// The frames of a motion or a pattern as a sequence, at their own rate unless another is given.
void add_motion(const SendCommand& command, const std::string& path, EmissionPlan& plan, std::vector<Drive>& drives) {
  const Motion motion = read_motion_file(path);
  require(motion.complete, "{}: complete = 0: its end is missing, so its phases are not sent", path);
  const MotionMethod& method = chosen_method(motion.methods, command.method, path + ": it");
  require(!method.frames.empty(), "{}: method {} has no frames", path, method.name);
  for (const MotionFrame& frame : method.frames) {
    drives.push_back({frame.solution.phases, frame.solution.amplitudes});
  }
  if (!command.rate_given && method.frames.size() > 1) {
    plan.request.rate = frame_rate(method.frames, path);
  }
  plan.must_match.push_back(motion.array);
}

int send_command(const SendCommand& command, const CommonFlags& flags) {
  EmissionPlan plan = plan_of(command.options);
  std::vector<Drive> drives;
  for (const std::string& path : command.runs) {
    plan.read.push_back(result_file_at(path));
    if (archive_format(plan.read.back()) == kMotionArchive.name()) {
      require(command.runs.size() == 1 || command.rate_given, "{}: --rate must be given with more than one file", path);
      add_motion(command, plan.read.back(), plan, drives);
      continue;
    }
    const Run run = read_run_file(plan.read.back());
    if (!run.complete) {
      throw InputError(
          fmt::format("{}: complete = 0: the run did not finish, so its phases are not sent; "
                      "`touchfield run --from` computes it again",
                      path));
    }
    const MethodResult& method = chosen_method(run.methods, command.method, path + ": it");
    drives.push_back({method.solution.phases, method.solution.amplitudes});
    plan.must_match.push_back(run.array);
  }
  plan.array = layout_of(plan.must_match.front());
  plan.drives = [&](const ArrayLayout&) { return drives; };
  return print_emission(emit(plan), flags);
}

}  // namespace

void add_array_command(CLI::App& app, Invocation& invocation) {
  const auto array = std::make_shared<ArrayCommand>();
  CLI::App* command = app.add_subcommand("array", "Test an array on the bench: list, test, walk, off");
  command->require_subcommand(1);
  using Action = int (*)(const ArrayCommand&, const CommonFlags&);
  const auto add_action = [&](const char* name, const char* what, Action action) {
    CLI::App* added = command->add_subcommand(name, what);
    add_device(added, array->options);
    added->add_option("--run", array->run, "A run with this array, for the places of its units or for a dry run")
        ->type_name(kH5File);
    finish_command(added, invocation,
                   [array, action](const Invocation& invoked) { return action(*array, invoked.flags); });
    return added;
  };
  add_action("list", "List links and serial ports; with --to: describe that device", list);
  CLI::App* focus = add_action("test", "Emit a focus at a point", test);
  add_emission(focus, array->options);
  add_numbers(focus, "--at-mm", array->at_mm, {}, "Focus: x y z in the array's own frame")->expected(3);
  add_number(focus, "--temperature-c", array->temperature_c, schema::between(-50, 60), "Of the air");
  add_number(focus, "--seconds", array->options.request.seconds, schema::above(0), "Time of emission; default: 1");
  CLI::App* one_by_one = add_action("walk", "Switch on one transducer after another, to check the wiring", walk);
  add_emission(one_by_one, array->options);
  constexpr double kMostTransducers = 1e6;
  add_whole(one_by_one, "--first", array->first, schema::between(0, kMostTransducers),
            "Number of the first transducer, from 0")
      ->default_str("0");
  add_whole(one_by_one, "--count", array->count, schema::between(1, kMostTransducers),
            "Number of transducers; default: all up to the last");
  add_number(one_by_one, "--dwell", array->dwell, schema::above(0), "Time on each [s]");
  add_action("off", "Switch every transducer off", off);
}

void add_send_command(CLI::App& app, Invocation& invocation) {
  const auto send = std::make_shared<SendCommand>();
  EmissionRequest& request = send->options.request;
  request.rate = 10;
  CLI::App* command = app.add_subcommand("send", "Send the phases of runs, motions or patterns to an array");
  command
      ->add_option("RUN", send->runs,
                   "run.h5, motion.h5 or pattern.h5, or the directory that holds it; several make a sequence")
      ->required()
      ->type_name(kH5File);
  command->add_option("--method", send->method, "Method of the phases; default: the only one");
  add_device(command, send->options);
  add_emission(command, send->options);
  add_number(
      command, "--seconds", request.seconds, schema::above(0),
      "Time of emission [s], the last frame is held; default: 1 for one run, else one pass through the sequence");
  CLI::Option* rate =
      add_number(command, "--rate", request.rate, schema::above(0),
                 "Frames per second of a sequence; default: that of a motion or pattern, or 10 of several runs");
  command->add_flag("--repeat", request.repeat, "Repeat the sequence after its last frame");
  command->add_flag("--stored", request.stored, "Let the device store the sequence and repeat it by its own clock");
  finish_command(command, invocation, [send, rate](const Invocation& invoked) {
    send->rate_given = rate->count() > 0;
    return send_command(*send, invoked.flags);
  });
}

}  // namespace touchfield
