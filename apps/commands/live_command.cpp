#include <algorithm>
#include <chrono>
#include <cstddef>
#include <exception>
#include <future>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>
#include <omp.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/device_options.h"
#include "apps/commands/job_console.h"
#include "apps/commands/live_stream.h"
#include "apps/commands/live_view.h"
#include "apps/commands/standard_streams.h"
#include "hardware/link_address.h"
#include "hardware/player.h"
#include "hardware/stop_signals.h"
#include "sim/core/errors.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/jobs/play_scene.h"
#include "sim/model/stages.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/live.h"
#include "sim/motion/motion_sensor.h"
#include "sim/run/archive_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/run_directory.h"
#include "sim/run/run_file.h"
#include "sim/run/text_table.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

/// Of the frames that the link took, by their numbers: the CRC-32 of the phase steps and then the intensity steps, a
/// byte a transducer.
using SentChecksums = std::map<std::size_t, std::string>;

using Times = std::vector<double>;  // [s], a frame; NaN where there is none

Json spread(const Times& times) {
  const Statistics over_frames = statistics(times);
  return {{"median_s", over_frames.median}, {"p95_s", over_frames.p95}, {"worst_s", over_frames.worst}};
}

Json stage_spreads(const std::vector<StageSeconds>& stages) {
  Json spreads = Json::object();
  for (const std::string& name : stages_of(stages)) {
    Times times;
    for (const StageSeconds& seconds : stages) {
      times.push_back(stage_seconds(seconds, name));
    }
    spreads[name] = spread(times);
  }
  return spreads;
}

/// Frames, silences, and the median, 95th percentile and worst of times, those of `solve` by stage.
///
/// stale_after   age from which a frame is stale [s]
/// play          how what the loop found was played
Json live_value(const LiveReport& loop, const PlayReport& play, double stale_after) {
  const std::size_t count = loop.frames.size();
  std::vector<StageSeconds> solve_stages;
  Times latencies;
  Times solves;
  Times sends;  // from the phases of a frame until the link had taken it
  for (std::size_t f = 0; f < count; ++f) {
    const MotionFrame& frame = loop.frames[f];
    solve_stages.push_back(frame.seconds);
    latencies.push_back(frame.shown - frame.sampled);
    solves.push_back(loop.solved[f] - frame.started);
    sends.push_back(frame.shown - loop.solved[f]);
  }
  return {{"frames", count},
          {"seconds", play.seconds},
          {"rate_hz", static_cast<double>(count) / std::max(play.seconds, 1e-9)},
          {"sent", play.sent},
          {"late", loop.late},
          {"dropped", loop.dropped},
          {"waiting", loop.waiting},
          {"silent_frames", std::ranges::count(loop.frames, true, &MotionFrame::silent)},
          {"lost_frames", std::ranges::count(loop.frames, true, &MotionFrame::lost)},
          {"stale", play.stale},
          {"unsent", count - play.sent - play.stale},  // a newer one, or the end, overtook them
          {"stale_after_s", stale_after},
          {"silences", play.silences},
          {"silent_s", play.silent},
          {"worst_residual", loop.residual},
          {"samples", loop.sensed.size()},
          {"overtaken", loop.overtaken},
          {"sense", spread(loop.sensed)},
          {"sense_stages", stage_spreads(loop.sensed_stages)},
          {"latency", spread(latencies)},
          {"solve", spread(solves)},
          {"stages", stage_spreads(solve_stages)},
          {"send", spread(sends)}};
}

/// live.csv: a header line and one line per frame. A line begins with the frame's number, its times since the loop
/// began [s], whether it is silent, and whether it is lost. Then follow the distance of the target from its true place
/// [mm], the checksum as it was sent, and the seconds per stage. A value that a frame does not have is nan; a missing
/// checksum is empty.
std::string live_csv(const LiveReport& report, const SentChecksums& sent) {
  const std::vector<std::string> stages = stages_of(report.frames);
  const auto row_of = [&](std::size_t number, const MotionFrame& frame, double solved) {
    Json row = {{"frame", number},
                {"sampled_s", frame.sampled},
                {"started_s", frame.started},
                {"late_s", frame.late},
                {"pose_time_s", frame.pose_time},
                {"solved_s", solved},
                {"shown_s", frame.shown},
                {"silent", frame.silent},
                {"lost", frame.lost},
                {"target_off_mm", frame.target_off / kMillimetre},
                {"sent_crc32", sent.contains(number) ? sent.at(number) : ""}};
    for (const std::string& stage : stages) {
      row[stage + "_s"] = stage_seconds(frame, stage);
    }
    return row;
  };
  Json rows = Json::array();
  for (std::size_t f = 0; f < report.frames.size(); ++f) {
    rows.push_back(row_of(f, report.frames[f], report.solved[f]));
  }
  return csv_text(row_of(0, {}, 0), rows);
}

constexpr double kLook = 0.05;      // [s] between looks for a signal while the solver is being made
constexpr double kPatience = 10.0;  // [s] for a frame that is being solved when the loop ends

struct LiveCommand {
  std::string scene;
  std::vector<std::string> overrides;
  std::string method;       // empty: the scene's only one
  std::string output;       // empty: no file
  std::optional<int> view;  // port of the page; none: no page
  DeviceOptions options;
};

std::string checksum_of(const DriveFrame& frame) {
  std::string bytes(frame.phase.begin(), frame.phase.end());
  bytes.append(frame.intensity.begin(), frame.intensity.end());
  return checksum(bytes);
}

Scene moving_scene(const LiveCommand& command) {
  Scene scene = read_scene(command.scene, command.overrides);
  require(scene.motion, "{}: the scene has no motion: section, which live needs; `touchfield run` computes a still",
          command.scene);
  return scene;
}

MotionSpec motion_of(const Scene& scene, const std::optional<double>& seconds) {
  MotionSpec motion = *scene.motion;
  if (seconds && !(*seconds <= motion.seconds)) {
    throw InputError(fmt::format("--seconds = {:g} must be <= motion.seconds = {:g}", *seconds, motion.seconds));
  }
  motion.seconds = seconds.value_or(motion.seconds);
  return motion;
}

/// One command from its scene to its report. Signals are held back before there are threads, so that none of them takes
/// one; what takes its time is done beside a look for them.
class Live {
 public:
  Live(const LiveCommand& command, const CommonFlags& flags)
      : command_(command),
        flags_(flags),
        progress_(flags),
        scene_(moving_scene(command)),
        method_(chosen_method(scene_.solve.methods, command.method, "the scene")),
        motion_(motion_of(scene_, command.options.request.seconds)) {
    require_apart(command.output, command.scene, scene_);
    if (command.view) {
      require(*command.view == 0 || *command.view >= 1024, "--view {} must be 0 or 1024 to 65535", *command.view);
      view_.emplace(*command.view);
    }
  }

  int run() {
    EmissionPlan plan = plan_of(command_.options);
    build();
    plan.request.rate = motion_.frames_hz;
    plan.request.seconds = motion_.seconds;
    plan.signals = &signals_;
    std::ranges::copy(read_by(command_.scene, scene_), std::back_inserter(plan.read));
    plan.array = layout_of(sensed_->solved().first().fixed->array);
    plan.must_match = {sensed_->solved().first().fixed->array};
    plan.drives = [this](const ArrayLayout&) { return std::vector<Drive>{prepared()}; };
    plan.observer = [this](std::size_t number, const DriveFrame& frame) { sent_[number] = checksum_of(frame); };
    plan.stream = [this](const Rounding& rounded) {
      FrameStream stream = stream_of(*loop_, motion_, rounded);
      if (view_) {
        stream.told = [this](const PlayReport& so_far, bool sounds, double age) {
          view_->played(so_far, sounds && loop_->sounds(), age);
        };
      }
      return stream;
    };
    EmissionReport report;
    std::exception_ptr failure;
    try {
      report = emit(plan);
    } catch (...) {
      failure = std::current_exception();
    }
    if (view_) {
      view_->end(failure || report.failure ? "the loop has failed; its terminal says why" : "the loop has ended");
    }
    const bool ended = !loop_ || loop_->stop(kPatience);
    try {
      if (failure) {
        std::rethrow_exception(failure);
      }
      int code = 0;
      try {
        code = reported(report, ended);
      } catch (const std::exception& error) {
        if (!report.failure) {
          throw;
        }
        progress_.warn(error.what());  // how the array was left counts more
      }
      if (report.failure) {
        std::rethrow_exception(report.failure);
      }
      if (ended) {
        loop_->rethrow();
        return code;
      }
      throw NumericalError(fmt::format("the solver does not respond: no frame for {:g} s", kPatience));
    } catch (const std::exception& error) {
      if (directory_) {
        directory_->fail(error.what());
      }
      if (ended) {
        throw;
      }
      // Its thread cannot be waited for.
      say(fmt::format("touchfield: error: {}\n", error.what()));
      ::_exit(finish_output(1));
    }
  }

 private:
  void build() {
    progress_.note(fmt::format("live: building {}", scene_.name));
    keep_freed_memory();
    std::future<SensedMotion> built = std::async(std::launch::async, [this] {
      leave_one_to_the_sensor(apply_threads(flags_), *scene_.motion);
      const Scene scene = within_budget(scene_, notes_, &progress_);
      apply_threads(flags_);
      SensedMotion sensed = sensed_motion(scene, nullptr, &progress_, MotionClock::kWall);
      timed(progress_, "sensor learning", [&] { sensed.sensor->start(progress_); });
      return sensed;
    });
    while (built.wait_for(std::chrono::duration<double>(kLook)) != std::future_status::ready) {
      leave_if_interrupted();
    }
    sensed_.emplace(built.get());
    method_ = chosen_method(sensed_->scene.solve.methods, command_.method, "the scene");
    motion_ = motion_of(sensed_->scene, command_.options.request.seconds);
    std::ranges::copy(sensed_->sensor->notes(), std::back_inserter(notes_));
    const Remarks remarks = moving_remarks(sensed_->truth ? *sensed_->truth : sensed_->solved());
    std::ranges::copy(remarks.notes, std::back_inserter(notes_));
    say_new(remarks.warnings);
    say_new(sensor_warnings(*sensed_->sensor, motion_.sensor.hz));
    for (const std::string& note : notes_) {
      progress_.remark(note);
    }
  }

  /// Warnings that were not said before.
  void say_new(const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings) {
      if (std::ranges::find(warnings_, warning) == warnings_.end()) {
        warnings_.push_back(warning);
        progress_.warn(warning);
      }
    }
  }

  /// The solver, made in the loop's thread, and the phases that it began with.
  Drive prepared() {
    if (!command_.output.empty()) {
      directory_.emplace(RunDirectory::at(command_.output, {"live.csv"}, command_.options.device.replace));
    }
    const Model& solved = sensed_->solved().first();
    progress_.note(fmt::format("live: preparing {}: {} faces, {} channels; the solver sees {}", method_.name,
                               solved.body.mesh.face_count(), solved.fixed->array.size(), sensor_text(motion_.sensor)));
    LiveSolution first;
    const auto prepare = [&] {
      const int threads = apply_threads(flags_);
      LiveSolver solver = timed(progress_, "prepare the solver", [&] {
        return live_solver(*sensed_->sensor, method_, first, &progress_,
                           [this] { return view_ && view_->wants_skin(); });
      });
      leave_one_to_the_sensor(threads, motion_);
      return solver;
    };
    loop_.emplace(
        motion_,
        [this](std::int64_t number, double seconds) {
          omp_set_num_threads(1);
          return sensed_->sensor->sample(number, seconds);
        },
        prepare, time_, sensed_->sensor->recording());
    while (!loop_->ready(kLook)) {
      leave_if_interrupted();
    }
    if (view_) {
      const DeviceOptions& options = command_.options;
      view_->begin(*loop_, sensed_->scene.name, method_, first,
                   options.emit && parse_link_address(options.device.link).kind != LinkAddress::Kind::kDryRun);
      progress_.note("live: seen at " + view_->address());
    }
    progress_.note(fmt::format("live: playing {:g} s", motion_.seconds));
    return {first.frame.solution.phases, first.frame.solution.amplitudes};
  }

  /// A sensor that computes has a thread of its own; this one gets the others.
  static void leave_one_to_the_sensor(int threads, const MotionSpec& motion) {
    if (!is_exact(motion.sensor)) {
      omp_set_num_threads(std::max(1, threads - 1));
    }
  }

  void leave_if_interrupted() {
    if (!signals_.wait(0)) {
      return;
    }
    if (directory_) {
      directory_->fail("interrupted by " + StopSignals::name(signals_.signal()));
    }
    say("touchfield: interrupted before anything was sent\n");
    ::_exit(128 + signals_.signal());
  }

  LiveReport with_target_off(LiveReport loop) const {
    if (sensed_->truth) {
      for (MotionFrame& frame : loop.frames) {
        frame.target_off = target_off(*sensed_->truth, frame);
      }
    }
    return loop;
  }

  int reported(EmissionReport report, bool ended) {
    const LiveReport loop = loop_->report();
    report.play.late = static_cast<std::size_t>(loop.late);
    report.play.dropped = static_cast<std::size_t>(loop.dropped);
    for (const MotionFrame& frame : loop.frames) {
      report.play.worst_delay = std::max(report.play.worst_delay, frame.late);
    }
    if (directory_) {
      write_text_file(directory_->file("live.csv"), live_csv(with_target_off(loop), sent_));
      if (!report.failure) {
        directory_->publish();
      }
      progress_.note(fmt::format("frames in {}", directory_->file("live.csv")));
    }
    const double tolerance = scene_.solve.solver.tolerance;
    if (loop.residual > tolerance) {
      progress_.warn(
          fmt::format("residual: the equations of a frame have a residual of {:.1e}, above the tolerance of {:.1e}",
                      loop.residual, tolerance));
    }
    if (ended) {
      say_new(sensor_warnings(*sensed_->sensor, motion_.sensor.hz));
    }
    Json value = emission_value(report);
    Json live = live_value(loop, report.play, motion_.stale);
    live.update({{"warnings", warnings_}, {"notes", notes_}});
    value["live"] = live;
    print_value(value, flags_);
    return said_exit_code(report);
  }

  const LiveCommand& command_;
  const CommonFlags& flags_;
  StopSignals signals_;
  ConsoleProgress progress_;
  Scene scene_;
  MethodSpec method_;
  MotionSpec motion_;
  std::vector<std::string> warnings_;
  std::vector<std::string> notes_;  // of the frame that was chosen for a budget, and of the model
  Progress silent_;
  std::optional<SensedMotion> sensed_;
  std::optional<RunDirectory> directory_;
  SentChecksums sent_;
  SteadyTime time_;
  std::optional<LiveView> view_;
  std::optional<LiveLoop> loop_;  // the last of all: its threads use what is above
};

}  // namespace

void add_live_command(CLI::App& app, Invocation& invocation) {
  const auto live = std::make_shared<LiveCommand>();
  CLI::App* command =
      app.add_subcommand("live", "Play a moving scene in real time: sensor, solver and array in a loop");
  add_scene(command, live->scene, live->overrides);
  add_compute_device(command, live->overrides);
  command->add_option("--method", live->method, "Method of the scene; default: the only one");
  add_device(command, live->options);
  add_emission(command, live->options);
  add_number(command, "--seconds", live->options.request.seconds, schema::above(0),
             "Time of the loop [s]; default: the whole motion");
  add_whole(command, "--view", live->view, schema::between(0, 65535),
            "Show the loop in a browser, at http://127.0.0.1:N, N >= 1024; 0: a free port; default of N: 8040")
      ->expected(0, 1)
      ->default_str("8040");
  command->add_option("-o,--output", live->output, "Directory for live.csv with one line per frame; default: no file")
      ->type_name(kFolder);
  finish_command(command, invocation, [live](const Invocation& invoked) { return Live(*live, invoked.flags).run(); });
}

}  // namespace touchfield
