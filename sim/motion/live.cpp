#include "sim/motion/live.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <pthread.h>

#include "sim/motion/frame_solver.h"

namespace touchfield {

namespace {

constexpr double kLookAgain = 1e-3;   // [s]: for a sample where there is none yet
constexpr double kLongestWait = 1e3;  // [s] at a time: no clock overflows

std::chrono::duration<double> seconds_of(double seconds) { return std::chrono::duration<double>(seconds); }

/// As `top -H` shows this thread, and the threads that it makes.
void name_thread(const char* name) { ::pthread_setname_np(::pthread_self(), name); }

/// The motion of a loop whose solve times are its own.
MotionSpec measured(MotionSpec motion) {
  motion.solve.reset();
  return motion;
}

}  // namespace

void SteadyTime::wait_until(double t, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  for (double left = t - now(); left > 0 && !stop.stop_requested(); left = t - now()) {
    never.wait_for(lock, stop, seconds_of(std::min(left, kLongestWait)), [] { return false; });
  }
}

LiveLoop::LiveLoop(const MotionSpec& motion, LiveSensor sensor, std::function<LiveSolver()> prepare, LiveTime& time,
                   const RecordedTimes* recorded)
    : motion_(measured(motion)),
      sensor_(std::move(sensor)),
      recorded_(recorded != nullptr ? std::optional(*recorded) : std::nullopt),
      time_(time) {
  LoopClock checked(motion_);
  const auto slots = static_cast<std::size_t>(std::ceil(motion.seconds * motion.frames_hz));
  report_.frames.reserve(slots);
  report_.solved.reserve(slots);
  report_.sensed.reserve(static_cast<std::size_t>(std::ceil(motion.seconds * motion.sensor.hz)));
  solver_thread_ =
      std::jthread([this, make = std::move(prepare)](const std::stop_token& stop) { run([&] { solve(stop, make); }); });
}

bool LiveLoop::ready(double seconds) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, seconds_of(seconds), [this] { return ready_ || failure_; });
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  return ready_;
}

void LiveLoop::begin(double now) {
  {
    const std::lock_guard lock(mutex_);
    begun_ = now;
    ++running_;
  }
  sensor_thread_ = std::jthread([this](const std::stop_token& stop) { run([&] { sense(stop); }); });
  changed_.notify_all();
}

double LiveLoop::begun() const {
  const std::lock_guard lock(mutex_);
  return begun_.value();
}

void LiveLoop::committed(std::size_t number, double at) {
  const std::lock_guard lock(mutex_);
  const double shown = at - *begun_;
  report_.frames[number].shown = shown;
  handover_.add(to_ticks(shown - report_.solved[number]));
  sounds_ = !report_.frames[number].silent;
}

bool LiveLoop::sounds() const {
  const std::lock_guard lock(mutex_);
  return sounds_;
}

bool LiveLoop::over() const {
  const std::lock_guard lock(mutex_);
  return failure_ != nullptr;
}

void LiveLoop::rethrow() const {
  const std::lock_guard lock(mutex_);
  if (failure_) {
    std::rethrow_exception(failure_);
  }
}

bool LiveLoop::stop(double patience) {
  solver_thread_.request_stop();
  sensor_thread_.request_stop();
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, seconds_of(patience), [this] { return running_ == 0; });
}

LiveReport LiveLoop::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void LiveLoop::run(const std::function<void()>& work) {
  std::exception_ptr failure;
  try {
    work();
  } catch (...) {
    failure = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  if (failure && !failure_) {
    failure_ = std::move(failure);
  }
  --running_;
  changed_.notify_all();
}

bool LiveLoop::has_sample(std::int64_t number) const {
  return (!recorded_ || number < static_cast<std::int64_t>(recorded_->size())) &&
         sample_time(number) < to_ticks(motion_.seconds);
}

Tick LiveLoop::sample_time(std::int64_t number) const {
  return recorded_ ? to_ticks(recorded_->seconds(static_cast<std::size_t>(number)))
                   : instant(number, motion_.sensor.hz);
}

std::int64_t LiveLoop::newest_due(Tick at) const {
  return recorded_ ? static_cast<std::int64_t>(recorded_->newest(to_seconds(at))) : last_instant(at, motion_.sensor.hz);
}

void LiveLoop::sense(const std::stop_token& stop) {
  name_thread("sensor");
  const double begin = begun();
  const Tick latency = to_ticks(motion_.sensor.latency);
  LiveSample sample{.now = {.lost = true}, .prediction = MotionPrediction(motion_.predict, 1 / motion_.sensor.hz)};
  for (std::int64_t number = 0; has_sample(number); ++number) {
    time_.wait_until(begin + to_seconds(sample_time(number) + latency), stop);
    if (stop.stop_requested()) {
      return;
    }
    // Those that were known while this thread had no processor are overtaken.
    const double begun_at = time_.now();
    const std::int64_t newest = std::max(number, newest_due(to_ticks(begun_at - begin) - latency));
    const std::int64_t overtaken = newest - number;
    number = newest;
    Seen now = sensor_(number, to_seconds(sample_time(number)));
    {
      const std::lock_guard lock(mutex_);
      report_.sensed.push_back(time_.now() - begun_at);
      report_.sensed_stages.push_back(std::move(now.stages));
      report_.overtaken += overtaken;
    }
    sample.prediction.see(now);
    sample.now = std::move(now);
    sensed_.put(std::make_shared<const LiveSample>(sample));
  }
}

void LiveLoop::solve(const std::stop_token& stop, const std::function<LiveSolver()>& prepare) {
  name_thread("solver");
  const LiveSolver solver = prepare();
  double begin = 0;
  {
    std::unique_lock lock(mutex_);
    ready_ = true;
    changed_.notify_all();
    if (!changed_.wait(lock, stop, [this] { return begun_.has_value(); })) {
      return;
    }
    begin = *begun_;
  }
  LoopClock clock(motion_);
  while (const std::optional<FrameStart> start = clock.next()) {
    time_.wait_until(begin + to_seconds(start->at), stop);
    const std::shared_ptr<const LiveSample> sample = newest_sample(stop);
    if (!sample) {
      return;
    }
    auto frame = std::make_shared<LiveFrame>(frame_for(*start, *sample, clock, solver));
    if (stop.stop_requested()) {
      return;
    }
    clock.finished(std::max<Tick>(0, to_ticks(frame->solved) - start->at));
    frame->late = clock.late();
    frame->dropped = clock.dropped();
    keep(*frame, clock);
    newest_.put(frame);
    if (frame->skin) {
      newest_skin_.put(frame);
    }
    solved_.put(std::move(frame));
  }
}

std::shared_ptr<const LiveSample> LiveLoop::newest_sample(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (auto sample = sensed_.newest()) {
      return sample;
    }
    time_.wait_until(time_.now() + kLookAgain, stop);
  }
  return nullptr;
}

LiveFrame LiveLoop::frame_for(const FrameStart& start, const LiveSample& sample, const LoopClock& clock,
                              const LiveSolver& solver) {
  const double begin = begun();
  double wanted = sample.now.seconds;
  if (sample.prediction.predicts()) {
    const auto handover = [this] {
      const std::lock_guard lock(mutex_);
      return handover_.value();
    };
    wanted = to_seconds(clock.predicted_for(start, clock.expected_solve() + handover()));
  }
  const double started = time_.now() - begin;
  LiveSolution solution = solver(sample, wanted);
  LiveFrame frame;
  frame.number = static_cast<std::size_t>(start.number);
  frame.solved = time_.now() - begin;
  frame.frame = std::move(solution.frame);
  frame.skin = std::move(solution.skin);
  frame.frame.sampled = sample.now.seconds;
  frame.frame.started = started;
  frame.frame.late = started - to_seconds(start.due);
  frame.frame.pose_time = wanted;
  frame.frame.shown = kNotComputed;
  const std::lock_guard lock(mutex_);
  report_.residual = std::max(report_.residual, solution.residual);
  return frame;
}

void LiveLoop::keep(const LiveFrame& frame, const LoopClock& clock) {
  MotionFrame kept = frame.frame;
  kept.solution = {};
  const std::lock_guard lock(mutex_);
  report_.frames.push_back(std::move(kept));
  report_.solved.push_back(frame.solved);
  report_.late = clock.late();
  report_.dropped = clock.dropped();
  report_.waiting = clock.waiting();
}

LiveSolver live_solver(const MotionSensor& sensor, const MethodSpec& method, LiveSolution& first, Progress* progress,
                       std::function<bool()> watched) {
  const MovingModel& moving = sensor.solved();
  const auto solver = std::make_shared<FrameSolver>(moving, method, drives_for(sensor, method, progress));
  const auto found = [solver](MotionFrame frame, std::optional<Model> model) {
    LiveSolution solution{std::move(frame), solver->worst_residual()};
    if (model) {
      Eigen::VectorXcd pressure = Eigen::VectorXcd::Zero(model->body.mesh.face_count());
      if (!solution.frame.silent) {
        pressure = solver->pressure();
      }
      solution.skin = std::make_shared<SolvedSkin>(SolvedSkin{std::move(*model), std::move(pressure), solver->scale()});
    }
    return solution;
  };
  std::optional<Model> begun;
  MotionFrame frame = solver->begin(&begun);
  first = found(std::move(frame), std::move(begun));
  return [&moving, solver, found, watched = std::move(watched)](const LiveSample& sample, double wanted) {
    std::optional<Model> model;
    MotionFrame solved =
        sample.now.lost ? solver->lost()
                        : solver->solve(moving.in_range(sample.prediction.at(wanted)), watched() ? &model : nullptr);
    return found(std::move(solved), std::move(model));
  };
}

}  // namespace touchfield
