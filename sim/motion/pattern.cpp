#include "sim/motion/pattern.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/version.h"
#include "sim/field/metrics.h"
#include "sim/field/radiation_skin.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/model/stages.h"
#include "sim/model/warnings.h"
#include "sim/motion/motion_instants.h"
#include "sim/run/felt.h"
#include "sim/run/methods.h"
#include "sim/run/motion_summary.h"
#include "sim/run/result_warnings.h"
#include "sim/run/skin_scattering.h"
#include "sim/run/solve_model.h"
#include "sim/run/transfer.h"
#include "sim/scene/scene_reader.h"
#include "solvers/phase/phase_methods.h"
#include "solvers/phase/phase_sequence.h"

namespace touchfield {

namespace {

/// What the frames of a pattern work on and are scored by.
struct PatternProblem {
  PatternSpots spots;
  PhaseSequence sequence;
  NearSkin near{};                // of method radiation: its faces are the spots'
  NearSkin patch{};               // about the middle of the pattern, for what the skin does
  Eigen::MatrixXcd patch_rows{};  // of H, of its faces
  Eigen::VectorXd areas;          // A, U [m2]
  double outside_weight = 0;

  /// The column of the sequence that a frame wants: of the target's boxes all want the same.
  Eigen::Index column(Eigen::Index frame) const { return sequence.frame_count() == 1 ? 0 : frame; }

  /// What a column wants, at a share of its strength; faces in no box.
  Target target(Eigen::Index column, double share) const {
    Target wanted;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index j = 0; share > 0 && j < areas.size(); ++j) {
      if (spots.shares(j, column) > 0) {
        rows.push_back(j);
        wanted.faces.push_back(spots.faces[static_cast<std::size_t>(j)]);
      }
    }
    wanted.amplitudes = share * spots.amplitudes.col(column)(rows);
    wanted.shares = spots.shares.col(column)(rows);
    if (share > 0) {
      wanted.box = spots.box[static_cast<std::size_t>(column)];
      wanted.boxes = spots.boxes[static_cast<std::size_t>(column)];
    }
    return wanted;
  }

  /// The metrics of drives whose wanted pressures are `share` of the column's.
  Metrics metrics(Eigen::Index column, double share, const Eigen::VectorXcd& q) const {
    const Eigen::VectorXd p = (sequence.rows * q).cwiseAbs();
    const Eigen::VectorXd wanted = share * spots.amplitudes.col(column);
    const Eigen::VectorXd inside = areas.cwiseProduct(spots.shares.col(column));
    const double energy = areas.dot(p.cwiseAbs2()) + (sequence.outside * q).squaredNorm() / outside_weight;
    const double common = inside.cwiseProduct(p).dot(wanted);
    const double asked = inside.dot(wanted.cwiseAbs2());
    Metrics metrics;
    metrics.peak_pa = p.maxCoeff();
    if (asked > 0 && energy > 0) {
      metrics.correlation = common / std::sqrt(energy * asked);
      metrics.relative_error = std::sqrt(std::max(0.0, 1.0 - metrics.correlation * metrics.correlation));
      metrics.relative_error_raw = std::sqrt(std::max(0.0, (energy - 2.0 * common + asked) / asked));
      metrics.scale = common / energy;
      metrics.leakage = 1.0 - inside.dot(p.cwiseAbs2()) / energy;
      const double area = inside.sum();
      metrics.mean_inside_pa = inside.dot(p) / area;
      metrics.reached_share = inside.dot(p) / inside.dot(wanted);
      metrics.cv_inside =
          std::sqrt(inside.dot((p.array() - metrics.mean_inside_pa).square().matrix()) / area) / metrics.mean_inside_pa;
    }
    return metrics;
  }
};

/// Spots whose faces are those of the near skin: more of them, in its order.
PatternSpots on_near_skin(const PatternSpots& spots, const NearSkin& near) {
  const auto faces = static_cast<Eigen::Index>(near.faces.size());
  const Eigen::Index columns = spots.amplitudes.cols();
  PatternSpots wider = spots;
  wider.faces = near.faces;
  wider.amplitudes.setZero(faces, columns);
  wider.shares.setZero(faces, columns);
  wider.middle.clear();
  std::vector<Eigen::Index> place;
  for (const Eigen::Index face : spots.faces) {
    place.push_back(std::ranges::find(near.faces, face) - near.faces.begin());
  }
  wider.amplitudes(place, Eigen::all) = spots.amplitudes;
  wider.shares(place, Eigen::all) = spots.shares;
  for (const Eigen::Index middle : spots.middle) {
    wider.middle.push_back(place[static_cast<std::size_t>(middle)]);
  }
  return wider;
}

PatternProblem problem_on(const Model& model, SkinScattering& scattering, PatternSpots spots, const SkinPatch& patch,
                          Progress& progress) {
  PatternProblem problem;
  problem.patch = near_skin(model.body.mesh, patch.faces, model.fixed->wave);
  problem.outside_weight = model.fixed->scene.solve.outside_weight;
  const bool radiation = model.fixed->scene.pattern->method->radiation;
  if (radiation) {
    Target all;
    all.faces = spots.faces;
    problem.near = near_skin(model.body.mesh, all, model.fixed->wave);
    spots = on_near_skin(spots, problem.near);
  }
  const auto used = static_cast<Eigen::Index>(spots.faces.size());
  const Target target{spots.faces, spots.amplitudes.rowwise().maxCoeff(), std::vector<int>(spots.faces.size(), 0),
                      Eigen::VectorXd::Ones(used)};
  Transfer transfer =
      make_transfer(scattering, target, outside_skin(model), problem.outside_weight, problem.patch.faces);
  problem.patch_rows = std::move(transfer.rows);
  progress.detail(describe_transfer(transfer, model.fixed->array.size()));
  problem.areas = transfer.reduction.problem.weights;
  PhaseSequence& sequence = problem.sequence;
  sequence.rows = std::move(transfer.reduction.problem.target);
  sequence.outside = std::move(transfer.reduction.problem.outside);
  const Eigen::MatrixXd inside = problem.areas.asDiagonal() * spots.shares;
  sequence.weights = problem.outside_weight * problem.areas.replicate(1, spots.shares.cols()) +
                     (1.0 - problem.outside_weight) * inside;
  sequence.amplitudes = inside.cwiseProduct(spots.amplitudes).cwiseQuotient(sequence.weights);
  sequence.middle = spots.middle;
  problem.spots = std::move(spots);
  for (Eigen::Index column = 0; radiation && column < sequence.frame_count(); ++column) {
    const Target wanted = problem.target(column, 1.0);
    Eigen::VectorXd counted(sequence.rows.rows() + sequence.outside.rows());
    counted << problem.areas - inside.col(column),
        Eigen::VectorXd::Constant(sequence.outside.rows(), 1.0 / problem.outside_weight);
    sequence.radiation.push_back(radiation_skin(problem.near, model.body.mesh, wanted, wanted.amplitudes,
                                                outside_skin(model), model.fixed->wave, MethodSpec{}.outside_weight,
                                                counted));
  }
  return problem;
}

/// The drives of every frame, with its amplitude modulation.
std::vector<PhaseSolution> frames_of(const PatternSpec& spec, const PatternClock& clock, const Model& model,
                                     const PatternProblem& problem, Progress& progress) {
  SequenceOptions options{.iterations = spec.iterations, .closed = true};
  if (spec.most_turn) {
    options.most_turn = *spec.most_turn;
  }
  std::vector<PhaseSolution> solved = solve_sequence(problem.sequence, options, [&](int done, double) {
    progress.advance(static_cast<double>(done) / static_cast<double>(problem.sequence.frame_count()));
  });
  std::vector<PhaseSolution> frames;
  for (Eigen::Index k = 0; k < clock.frames; ++k) {
    PhaseSolution& own = solved[static_cast<std::size_t>(problem.column(k))];
    frames.push_back(problem.sequence.frame_count() == 1 ? own : std::move(own));
    const double share = wanted_share(spec, clock.time(k));
    frames.back().amplitudes *= share;
    for (double& cost : frames.back().cost_history) {
      cost *= std::pow(share, spec.method->radiation ? 4 : 2);
    }
    leave_out_dead(model.fixed->array.response, frames.back());
  }
  return frames;
}

double largest_turn(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  return (to - from)
      .unaryExpr([](double turn) { return std::abs(std::remainder(turn, 2.0 * std::numbers::pi)); })
      .maxCoeff();
}

/// The method by itself on a frame.
void solve_by_itself(const PatternSpec& spec, const PatternProblem& problem, Eigen::Index k, Pattern& pattern) {
  const double begun = steady_now();
  const PhaseSolution alone =
      touchfield::solve_alone(problem.sequence, problem.column(k), SequenceOptions{}.first_iterations, true);
  PatternFrame& frame = pattern.frames[static_cast<std::size_t>(k)];
  frame.alone_seconds = steady_now() - begun;
  const double share = wanted_share(spec, pattern.clock.time(k));
  frame.alone_error = problem.metrics(problem.column(k), share, share * drive(alone)).relative_error;
}

/// The same on some frames, to which the sequence is compared: each so many, and the worst of those that follow others.
void check_alone(const PatternSpec& spec, const PatternProblem& problem, std::optional<int> every, Pattern& pattern,
                 Progress& progress) {
  for (Eigen::Index k = 0; every && k < pattern.clock.frames; k += *every) {
    solve_by_itself(spec, problem, k, pattern);
    progress.advance(static_cast<double>(k) / pattern.clock.frames);
  }
  const std::vector<MotionScore>& scores = pattern.motion.methods.front().scores;
  std::size_t worst = 0;
  for (std::size_t k = 1; k < scores.size() && problem.sequence.frame_count() > 1; ++k) {
    const double error = scores[k].metrics.relative_error;
    worst = worst == 0 || error > scores[worst].metrics.relative_error ? k : worst;
  }
  if (worst > 0 && std::isnan(pattern.frames[worst].alone_error)) {
    solve_by_itself(spec, problem, static_cast<Eigen::Index>(worst), pattern);
  }
}

/// "frames_behind: ..." of the frame that is farthest above what it is by itself, else nothing.
std::optional<std::string> behind_warning(const PatternSpec& spec, const Pattern& pattern) {
  constexpr double kMostBehind = 0.02;
  const std::vector<MotionScore>& scores = pattern.motion.methods.front().scores;
  double most = kMostBehind;
  std::string frame;
  for (std::size_t k = 0; k < scores.size(); ++k) {
    const double error = scores[k].metrics.relative_error;
    const double alone = pattern.frames[k].alone_error;
    if (error - alone > most) {
      most = error - alone;
      frame = fmt::format("frame {} has a relative error of {:.1f} %, solved by itself {:.1f} %", k, 100.0 * error,
                          100.0 * alone);
    }
  }
  if (frame.empty()) {
    return std::nullopt;
  }
  return fmt::format("frames_behind: {}: frames do not follow the pattern; raise pattern.{} or frames_per_second",
                     frame, spec.most_turn ? "most_turn_deg" : "iterations");
}

void score_frames(const PatternSpec& spec, const PatternProblem& problem, Pattern& pattern) {
  MotionMethod& method = pattern.motion.methods.front();
  const Eigen::Index frames = pattern.clock.frames;
  Eigen::MatrixXcd drives(problem.sequence.rows.cols(), frames);
  for (Eigen::Index k = 0; k < frames; ++k) {
    const PhaseSolution& solution = method.frames[static_cast<std::size_t>(k)].solution;
    const PhaseSolution& before = method.frames[static_cast<std::size_t>((k + frames - 1) % frames)].solution;
    drives.col(k) = drive(solution);
    pattern.frames.push_back(
        {.level = solution.amplitudes.maxCoeff(), .turn = largest_turn(before.phases, solution.phases)});
    const double time = pattern.clock.time(k);
    method.scores.push_back({.time = time,
                             .frame = static_cast<int>(k),
                             .age = 0.0,
                             .metrics = problem.metrics(problem.column(k), wanted_share(spec, time), drives.col(k))});
  }
  if (spec.ring_up) {
    const Eigen::MatrixXcd emitted = rung_up(drives, 1.0 / pattern.clock.rate, *spec.ring_up);
    for (Eigen::Index k = 0; k < frames; ++k) {
      const double share = wanted_share(spec, pattern.clock.time(k));
      pattern.frames[static_cast<std::size_t>(k)].ring_error =
          problem.metrics(problem.column(k), share, emitted.col(k)).relative_error;
    }
  }
}

/// "below_wanted: ..." of the worst frame that the array is too weak for, else nothing. A spot may also be weak for its
/// shape, where the array could make more.
std::optional<std::string> weak_array_warning(const PatternProblem& problem, const Pattern& pattern) {
  int below = 0;
  double least = kLeastReached;
  std::string worst;
  const std::vector<MotionScore>& scores = pattern.motion.methods.front().scores;
  for (std::size_t k = 0; k < scores.size(); ++k) {
    const Metrics& metrics = scores[k].metrics;
    const double wanted = metrics.mean_inside_pa / metrics.reached_share;
    const auto column = static_cast<std::size_t>(problem.column(static_cast<Eigen::Index>(k)));
    const double most = problem.sequence.rows.row(problem.spots.middle[column]).cwiseAbs().sum();
    if (!(metrics.reached_share < kLeastReached && most < wanted)) {
      continue;
    }
    ++below;
    if (metrics.reached_share < least) {
      least = metrics.reached_share;
      worst =
          fmt::format("{} ({:.2g} %) of {}, where the array makes at most {} in the middle",
                      pressure_text(metrics.mean_inside_pa), 100.0 * least, pressure_text(wanted), pressure_text(most));
    }
  }
  if (below == 0) {
    return std::nullopt;
  }
  return fmt::format("below_wanted: {} of {} frames reach less than half of the wanted pressure; the least {}", below,
                     scores.size(), worst);
}

void listen(const PatternProblem& problem, const std::vector<PatternPoint>& points, Pattern& pattern) {
  const std::vector<Eigen::Index>& faces = problem.spots.faces;
  for (const PatternPoint& point : points) {
    PatternSound sound{point, Eigen::VectorXd(pattern.clock.frames), {}, {}};
    const Eigen::RowVectorXcd row = problem.sequence.rows.row(std::ranges::find(faces, point.face) - faces.begin());
    for (Eigen::Index k = 0; k < sound.pressure.size(); ++k) {
      const MotionFrame& frame = pattern.motion.methods.front().frames[static_cast<std::size_t>(k)];
      sound.pressure(k) = std::abs((row * drive(frame.solution)).value());
    }
    sound.radiation = pattern.motion.radiation_per_square * sound.pressure.cwiseAbs2();
    sound.lines = lines_of_held(sound.radiation, pattern.clock.rate, kHighestLine);
    pattern.motion.methods.front().watched.emplace_back(point.name, sound.pressure);
    pattern.sounds.push_back(std::move(sound));
  }
}

/// The face at felt.at_mm, or else nearest to the mean of the middles of all spots. Where that mean is off the skin, as
/// between two fingers, it is the middle of a spot.
Eigen::Index middle_face(const Model& model, const PatternSpots& spots) {
  const TriangleMesh& mesh = model.body.mesh;
  if (const std::optional<FeltSpec>& felt = model.fixed->scene.felt; felt && felt->at) {
    return felt_face(mesh, *felt->at);
  }
  Vector3 mean = Vector3::Zero();
  std::vector<Eigen::Index> middles;
  for (const Eigen::Index row : spots.middle) {
    middles.push_back(spots.faces[static_cast<std::size_t>(row)]);
    mean += mesh.centroids().col(middles.back()) / static_cast<double>(spots.middle.size());
  }
  const SkinPoint nearest = FaceTree(mesh).nearest(mean, kOffSkin);
  const auto off = [&](Eigen::Index face) { return (mesh.centroids().col(face) - mean).squaredNorm(); };
  return nearest.face >= 0 ? nearest.face : *std::ranges::min_element(middles, {}, off);
}

/// The radiation pressure on the patch in each frame.
void press(const Model& model, const PatternProblem& problem, const std::vector<PatternPoint>& points, SkinPatch patch,
           Pattern& pattern) {
  const std::vector<MotionFrame>& frames = pattern.motion.methods.front().frames;
  RadiationSkin skin = bare_skin(model.fixed->wave);
  skin.slopes = problem.patch.slopes;
  skin.wanted.setZero(problem.patch.count);
  MotionPatch& kept = pattern.motion.patch.emplace();
  kept.radiation.resize(problem.patch.count, pattern.clock.frames);
#pragma omp parallel for schedule(static)
  for (Eigen::Index k = 0; k < pattern.clock.frames; ++k) {
    kept.radiation.col(k) = radiation_of(skin, problem.patch_rows * drive(frames[static_cast<std::size_t>(k)].solution))
                                .cast<float>()
                                .cast<double>();
  }
  kept.skin = std::move(patch);
  kept.rate = pattern.clock.rate;
  for (const PatternPoint& point : points) {
    kept.points.emplace_back(point.name, point.at);
  }
}

/// The whole skin at instants that are spread over the pass, and how far the scores by R are from those of all faces.
void keep_instants(const Model& model, SkinScattering& scattering, const PatternProblem& problem, Pattern& pattern) {
  MotionMethod& method = pattern.motion.methods.front();
  const std::vector<int> kept = spread_numbers(pattern.clock.frames, most_instants(model.body.mesh.face_count(), 1));
  const auto count = static_cast<Eigen::Index>(kept.size());
  Eigen::MatrixXcd drives(model.fixed->array.size(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    drives.col(i) = drive(method.frames[static_cast<std::size_t>(kept[static_cast<std::size_t>(i)])].solution);
  }
  const Eigen::MatrixXcd pressure = scattering.pressure(drives, "instants");
  require_finite("pattern", pressure);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int frame = kept[static_cast<std::size_t>(i)];
    MotionScore& score = method.scores[static_cast<std::size_t>(frame)];
    Target target = problem.target(problem.column(frame), wanted_share(*model.fixed->scene.pattern, score.time));
    if (target.size() > 0) {
      const Metrics all = metrics_of(model.body.mesh, model.fixed->wave, model.boxes, target, pressure.col(i));
      score.metrics.relative_error_radiation = all.relative_error_radiation;
      if (model.beyond.empty()) {  // else R has more than the faces of the mesh
        pattern.reduced_off =
            std::fmax(pattern.reduced_off, std::abs(all.relative_error - score.metrics.relative_error));
      }
    }
    pattern.motion.instants.push_back(rounded({.time = score.time,
                                               .mesh = model.body.mesh,
                                               .target = std::move(target),
                                               .pressure = {{method.name, pressure.col(i)}}}));
  }
}

/// The pattern's motion before its first frame; the progress hears what is to be said of the model.
Motion begun(const Model& model, const PatternClock& clock, const PatternOptions& options, Progress& progress) {
  const Scene& scene = model.fixed->scene;
  const std::string text = resolved_yaml(scene);
  Remarks remarks = model_remarks(model);
  add({clock_warnings(*scene.pattern, clock), {}}, remarks);
  if (model.fixed->evaluation.elsewhere()) {
    remarks.notes.push_back(
        "own_model: a pattern is evaluated on the skin and with the channels that it is solved for; sensing, "
        "array.tolerances and evaluation do not apply");
  }
  std::ranges::for_each(remarks.warnings, [&](const std::string& warning) { progress.warn(warning); });
  std::ranges::for_each(remarks.notes, [&](const std::string& note) { progress.remark(note); });
  return {.name = scene.name,
          .scene = text,
          .seconds = clock.seconds(),
          .array = model.fixed->array,
          .radiation_per_square = radiation_per_square(model.fixed->wave.medium()),
          .mesh = model.body.mesh,
          .methods = {{.name = std::string(scene.pattern->method->name),
                       .method = std::string(scene.pattern->method->name),
                       .scheme = to_string(scene.solve.scheme)}},
          .warnings = remarks.warnings,
          .notes = remarks.notes,
          .provenance = provenance_now(options.threads, used_seeds(scene), options.command_line, text_hash(text))};
}

}  // namespace

Pattern solve_pattern(const Model& model, const PatternOptions& options, Progress& progress) {
  const Scene& scene = model.fixed->scene;
  const PatternSpec& spec = *scene.pattern;
  require(scene.solve.outside_weight > 0,
          "solve.outside_weight = 0: a pattern is also solved and scored on the skin outside of it; it must be > 0");
  const PatternClock clock = pattern_clock(spec);
  const std::vector<PatternPoint> points = pattern_points(spec, model);
  PatternSpots spots = pattern_spots(spec, clock, points, model);
  SkinPatch patch = skin_patch(model.body.mesh, middle_face(model, spots));
  Pattern pattern{.clock = clock, .motion = begun(model, clock, options, progress)};
  Motion& motion = pattern.motion;
  std::vector<SolveRecord> records;
  const auto scattering = timed(progress, motion.timings, "set_up", "set up the scattering model", [&] {
    const auto block = static_cast<Eigen::Index>(
        std::ceil(expected_drives(model.body.mesh, model.fixed->array, model.fixed->wave.wavelength())));
    return make_scattering("pattern", model.body.mesh, scene.solve.scheme, scene.solve.solver, block, model,
                           model.fixed->array.response, nullptr, records, progress);
  });
  progress.detail(describe_decision(*scattering));
  const PatternProblem problem = timed(progress, motion.timings, "transfer", "transfer matrix of the pattern", [&] {
    return problem_on(model, *scattering, std::move(spots), patch, progress);
  });
  pattern.faces = problem.sequence.rows.rows();
  pattern.outside_rows = problem.sequence.outside.rows();
  std::vector<PhaseSolution> solutions =
      timed(progress, motion.timings, "phases", fmt::format("phases of {} frames", pattern.clock.frames),
            [&] { return frames_of(spec, pattern.clock, model, problem, progress); });
  for (Eigen::Index k = 0; k < pattern.clock.frames; ++k) {
    const double time = pattern.clock.time(k);
    PhaseSolution& solution = solutions[static_cast<std::size_t>(k)];
    motion.methods.front().frames.push_back({.sampled = time,
                                             .started = time,
                                             .shown = time,
                                             .pose_time = time,
                                             .silent = solution.amplitudes.isZero(0.0),
                                             .solution = std::move(solution)});
  }
  const auto warn = [&](const std::optional<std::string>& warning) {
    if (warning) {
      progress.warn(*warning);
      motion.warnings.push_back(*warning);
    }
  };
  timed(progress, motion.timings, "scores", "errors, and pressure over time", [&] {
    score_frames(spec, problem, pattern);
    warn(weak_array_warning(problem, pattern));
    listen(problem, points, pattern);
    press(model, problem, points, std::move(patch), pattern);
  });
  timed(progress, motion.timings, "instants", "pressure of the whole skin at instants",
        [&] { keep_instants(model, *scattering, problem, pattern); });
  timed(progress, motion.timings, "check", "frames solved by themselves",
        [&] { check_alone(spec, problem, options.check, pattern, progress); });
  warn(behind_warning(spec, pattern));
  for (const SolveRecord& record : records) {
    if (!record.converged) {
      throw NumericalError(fmt::format("pattern: the residual of {:.1e} is above the tolerance of {:.1e}",
                                       record.residual, scene.solve.solver.tolerance));
    }
  }
  motion.complete = true;
  motion.provenance.card = used_card(records);
  motion.provenance.end = utc_now();
  return pattern;
}

}  // namespace touchfield
