#include "sim/motion/play.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "sim/core/text.h"
#include "sim/core/version.h"
#include "sim/field/metrics.h"
#include "sim/model/stages.h"
#include "sim/motion/frame_solver.h"
#include "sim/motion/loop_clock.h"
#include "sim/motion/motion_instants.h"
#include "sim/motion/motion_prediction.h"
#include "sim/motion/scorer.h"
#include "sim/run/evaluate_methods.h"
#include "sim/run/motion_summary.h"
#include "sim/run/result_warnings.h"
#include "sim/run/solve_model.h"
#include "sim/run/solver_choice.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

constexpr double kSeenAgain = 1;  // of samples before the newest one, after a frame that took long [s]

/// The loop of one method, which goes on as far as it is told to.
class MethodLoop {
 public:
  /// samples      of all methods
  /// keeps_seen   whether seen() is going to be called
  MethodLoop(const SensedMotion& sensed, SampleStore& samples, const MethodSpec& method, Eigen::MatrixXcd drives,
             bool keeps_seen)
      : sensed_(sensed),
        samples_(samples),
        keeps_seen_(keeps_seen),
        motion_(*sensed.scene.motion),
        clock_(motion_),
        prediction_(motion_.predict, 1 / motion_.sensor.hz),
        solver_(sensed.solved(), method, std::move(drives)) {
    solver_.begin();
  }

  /// Frames that start before `end`; `solved_at` hears when each of them started [s].
  void go_on(Tick end, std::vector<MotionFrame>& frames, const std::function<void(double)>& solved_at) {
    while (!over_) {
      if (!next_) {
        next_ = clock_.next();
        over_ = !next_;
      }
      if (over_ || next_->at >= end) {
        return;
      }
      frames.push_back(solved(*next_));
      solved_at(frames.back().started);
      next_.reset();
    }
  }

  std::optional<ScoreInstant> next_score() { return clock_.next_score(); }
  /// Where the target's patch really was at the sample of a frame; of no meaning without a target or a truth.
  const Vector3& patch(std::int64_t frame) const { return patches_[static_cast<std::size_t>(frame)]; }
  /// The sample of a frame; those of frames before it are forgotten. Nothing of a sample that was lost.
  const MotionState* seen(std::int64_t frame) {
    seen_.erase(seen_.begin(), seen_.lower_bound(frame));
    return !seen_.empty() && seen_.begin()->first == frame ? &seen_.begin()->second : nullptr;
  }
  std::int64_t dropped() const { return clock_.dropped(); }
  double worst_residual() const { return solver_.worst_residual(); }

 private:
  MotionFrame solved(const FrameStart& start) {
    see(start.sample);
    const Seen& now = samples_.at(start.sample);
    const double wanted = prediction_.predicts() ? to_seconds(clock_.predicted_for(start)) : now.seconds;
    const double begin = steady_now();
    MotionFrame frame = now.lost ? solver_.lost() : solver_.solve(sensed_.solved().in_range(prediction_.at(wanted)));
    const ShownFrame shown = clock_.finished(to_ticks(motion_.solve.value_or(steady_now() - begin)));
    if (keeps_seen_ && !now.lost) {
      seen_.emplace(start.number, now.state);
    }
    look_at_truth(now, frame);
    frame.sampled = now.seconds;
    frame.joints = now.joints;
    frame.started = to_seconds(start.at);
    frame.late = to_seconds(start.late());
    frame.shown = to_seconds(shown.from);
    frame.pose_time = wanted;
    if (sensed_.truth) {
      frame.target_off = target_off(*sensed_.truth, frame);
    }
    return frame;
  }

  /// The samples that a frame's expectation is made of: the newest one and, if anything is predicted, those of the last
  /// second.
  void see(std::int64_t newest) {
    std::int64_t number = newest;
    if (motion_.predict != MotionSpec::Prediction::kNone) {
      const double hz = motion_.sensor.hz;
      number = std::max(unseen_, last_instant(instant(newest, hz) - to_ticks(kSeenAgain), hz) + 1);
    }
    for (; number <= newest; ++number) {
      prediction_.see(samples_.at(number));
    }
    unseen_ = newest + 1;
  }

  /// Where the target's patch really was at a sample, and how far off what was seen of the skin is.
  void look_at_truth(const Seen& seen, MotionFrame& frame) {
    patches_.emplace_back(Vector3::Zero());
    if (!sensed_.truth || !sensed_.scene.target) {
      return;
    }
    const Model truth = sensed_.truth->at(sensed_.truth->state(seen.seconds));
    patches_.back() = sensed_.truth->patch(truth);
    if (!seen.lost && !is_exact(motion_.sensor)) {
      frame.off = seen_error(truth, sensed_.solved().at(seen.state));
    }
  }

  const SensedMotion& sensed_;
  SampleStore& samples_;
  const bool keeps_seen_;
  const MotionSpec& motion_;
  LoopClock clock_;
  MotionPrediction prediction_;
  std::int64_t unseen_ = 0;  // the first sample that the prediction has not seen
  FrameSolver solver_;
  std::optional<FrameStart> next_;
  bool over_ = false;
  std::vector<Vector3> patches_;
  std::map<std::int64_t, MotionState> seen_;  // frame -> its sample
};

class Player {
 public:
  Player(const SensedMotion& sensed, const MotionOptions& options, Progress& progress)
      : sensed_(sensed),
        options_(options),
        progress_(progress),
        samples_(*sensed.sensor, sensed.scene.motion->sensor.hz),
        motion_(begun()) {
    const Scene& scene = sensed.scene;
    say(moving_remarks(sensed.truth ? *sensed.truth : sensed.solved()));
    if (sensed.truth) {
      scorer_.emplace(*sensed.truth);
    } else {
      motion_.notes.emplace_back("unscored: the true place of the hand is not known, so nothing is scored");
    }
    if (sensed.sensor->remembers()) {
      timed(progress, motion_.timings, "sensor", "sensor learning before the clock starts",
            [&] { sensed.sensor->start(progress); });
    }
    say({sensor_warnings(*sensed.sensor, scene.motion->sensor.hz), sensed.sensor->notes()});
    std::map<Scheme, Eigen::MatrixXcd> drives;  // one matrix for all methods of a scheme
    for (const MethodSpec& method : scene.solve.methods) {
      Eigen::MatrixXcd& own = drives[method.scheme];
      if (own.size() == 0 && method.kind->model == MethodModel::kSkin) {
        const std::string name = to_string(method.scheme);
        own = timed(progress, motion_.timings, "drives_" + name, "reduced basis of the motion by " + name,
                    [&] { return drives_for(*sensed.sensor, method, &progress); });
      }
      timed(progress, motion_.timings, "start_" + method.name, "first phases of " + method.name,
            [&] { loops_.push_back(std::make_unique<MethodLoop>(sensed, samples_, method, own, keeps_seen())); });
      pending_.emplace_back();
      motion_.methods.push_back({method.name, std::string(method.kind->name), scheme_of(method)});
    }
    reached_.assign(loops_.size() + (scorer_ ? 1 : 0), 0.0);
  }

  Motion played() {
    const Tick end = to_ticks(motion_.seconds);
    const auto second = static_cast<Tick>(kTicksASecond);
    timed(progress_, motion_.timings, "play", fmt::format("play {:.4g} s of motion", motion_.seconds), [&] {
      for (Tick until = std::min(second, end);; until = std::min(until + second, end)) {
        play_until(until);
        if (until == end) {
          break;
        }
        options_.second(motion_);
      }
    });
    warn_of_reach();
    note_unconverged();
    motion_.complete = true;
    motion_.provenance.end = utc_now();
    options_.second(motion_);
    return std::move(motion_);
  }

 private:
  Motion begun() const {
    const Scene& scene = sensed_.scene;
    const MovingModel& solved = sensed_.solved();
    const std::string text = resolved_yaml(scene);
    Motion motion{.name = scene.name,
                  .scene = text,
                  .seconds = scene.motion->seconds,
                  .array = solved.first().fixed->array,
                  .radiation_per_square = radiation_per_square(solved.first().fixed->wave.medium()),
                  .mesh = solved.at(solved.state(0)).body.mesh,
                  .solved_skin = solved.first().fixed->solved_skin()};
    motion.notes = options_.notes;
    motion.provenance = provenance_now(options_.threads, used_seeds(scene), options_.command_line, text_hash(text));
    return motion;
  }

  void play_until(Tick until) {
    // Those behind every loop and its prediction.
    samples_.forget(to_seconds(until) - 1 - kSeenAgain - sensed_.scene.motion->sensor.latency -
                    2 / sensed_.scene.motion->sensor.hz);
    for (std::size_t m = 0; m < loops_.size(); ++m) {
      loops_[m]->go_on(until, motion_.methods[m].frames, [&](double at) { advance(m, at); });
      motion_.methods[m].dropped = static_cast<int>(loops_[m]->dropped());
      while (const auto score = loops_[m]->next_score()) {
        if (scorer_) {
          pending_[m].push_back(*score);
        }
      }
    }
    // An instant is scored once it is settled for every method.
    while (std::ranges::none_of(pending_, [](const auto& scores) { return scores.empty(); })) {
      score();
    }
  }

  /// Where the loop of a method is, or behind them all the scores [s]; each counts as much as another.
  void advance(std::size_t part, double at) {
    reached_[part] = at;
    const double sum = std::accumulate(reached_.begin(), reached_.end(), 0.0);
    progress_.advance(sum / (motion_.seconds * static_cast<double>(reached_.size())));
  }

  void score() {
    const double at = to_seconds(pending_.front().front().at);
    Eigen::MatrixXcd drives = Eigen::MatrixXcd::Zero(motion_.array.size(), static_cast<Eigen::Index>(loops_.size()));
    for (std::size_t m = 0; m < loops_.size(); ++m) {
      if (const auto& frame = pending_[m].front().frame) {
        const auto number = static_cast<std::size_t>(frame->start.number);
        drives.col(static_cast<Eigen::Index>(m)) = sounding_drive(
            motion_.methods[m].frames[number].solution, sensed_.truth->first().fixed->evaluation.channels.phase_levels);
      }
    }
    const Scorer::Scored scored = scorer_->at(at, drives);
    advance(loops_.size(), at);
    std::optional<MotionInstant> instant;
    if (scored.mesh) {
      instant.emplace(MotionInstant{.time = at, .mesh = *scored.mesh, .target = scored.target});
    }
    for (std::size_t m = 0; m < loops_.size(); ++m) {
      MotionScore score;
      score.time = at;
      if (const auto& frame = pending_[m].front().frame) {
        score.frame = static_cast<int>(frame->start.number);
        score.age = to_seconds(pending_[m].front().age());
        const bool silent = motion_.methods[m].frames[static_cast<std::size_t>(score.frame)].silent;
        score.displacement = silent ? Vector3::Constant(kNotComputed).eval()
                                    : Vector3(scored.patch - loops_[m]->patch(frame->start.number));
      }
      score.metrics = scored.metrics[m];
      motion_.methods[m].scores.push_back(std::move(score));
      if (instant) {
        instant->pressure.emplace_back(motion_.methods[m].name, scored.pressure.col(static_cast<Eigen::Index>(m)));
      }
      pending_[m].pop_front();
    }
    if (instant) {
      if (!motion_.evaluation) {
        motion_.evaluation = scored.mesh;
        const double scores = std::ceil(motion_.seconds * sensed_.scene.motion->score_hz);
        kept_ = spread_numbers(static_cast<int>(scores), most_instants(scored.mesh->face_count(), loops_.size()));
      }
      options_.scored(*instant);
      keep(*std::move(instant));
    }
  }

  /// Only the first method remembers samples.
  bool keeps_seen() const { return loops_.empty() && scorer_ && !is_exact(sensed_.scene.motion->sensor); }

  void keep(MotionInstant instant) {
    const std::vector<MotionScore>& scores = motion_.methods.front().scores;
    const MotionState* seen = loops_.front()->seen(scores.back().frame);
    if (!std::ranges::binary_search(kept_, static_cast<int>(scores.size()) - 1)) {
      return;
    }
    if (seen != nullptr) {
      instant.sensed = sensed_.solved().at(*seen).body.mesh;
    }
    motion_.instants.push_back(rounded(std::move(instant)));
  }

  void say(const Remarks& remarks) {
    for (const std::string& warning : remarks.warnings) {
      motion_.warnings.push_back(warning);
      progress_.warn(warning);
    }
    for (const std::string& note : remarks.notes) {
      motion_.notes.push_back(note);
      progress_.remark(note);
    }
  }

  /// Of a scene that says which pressure it wants, methods that reach less than half of it on the median instant.
  void warn_of_reach() {
    if (!sensed_.scene.target || !sensed_.scene.target->pressure) {
      return;
    }
    for (std::size_t m = 0; m < motion_.methods.size(); ++m) {
      const MotionSummary over = summary(motion_.methods[m]);
      const Statistics& share = statistics_of(over, &Metrics::reached_share);
      if (sensed_.scene.solve.methods[m].kind->model != MethodModel::kGiven && share.median < kLeastReached) {
        say({{fmt::format("below_wanted: {} reaches {:.2g} % of the pressure wanted on the target, the median over the "
                          "motion: lower the wanted pressure, or use a larger or nearer array",
                          motion_.methods[m].name, 100.0 * share.median)},
             {}});
      }
    }
  }

  void note_unconverged() {
    const SolveSpec& solve = sensed_.scene.solve;
    double tolerance = solve.solver.tolerance;
    double worst = scorer_ ? scorer_->worst_residual() : 0.0;
    for (std::size_t m = 0; m < loops_.size(); ++m) {
      const double allowed = frame_tolerance(solve.solver, solve.methods[m].scheme);
      if (loops_[m]->worst_residual() / allowed > worst / tolerance) {
        worst = loops_[m]->worst_residual();
        tolerance = allowed;
      }
    }
    if (worst > tolerance) {
      say({{fmt::format(
               "residual: the equations of a frame or score have a residual of {:.1e}, above the tolerance of {:.1e}",
               worst, tolerance)},
           {}});
    }
  }

  const SensedMotion& sensed_;
  const MotionOptions& options_;
  Progress& progress_;
  std::optional<Scorer> scorer_;
  SampleStore samples_;
  Motion motion_;
  std::vector<std::unique_ptr<MethodLoop>> loops_;
  std::vector<std::deque<ScoreInstant>> pending_;
  std::vector<int> kept_;        // scores whose instants the motion keeps
  std::vector<double> reached_;  // of advance()
};

}  // namespace

Motion play_motion(const SensedMotion& sensed, const MotionOptions& options, Progress& progress) {
  return Player(sensed, options, progress).played();
}

}  // namespace touchfield
