#pragma once

#include <cstring>
#include <optional>
#include <tuple>
#include <vector>

#include "sim/run/motion_data.h"
#include "sim/run/run_data.h"
#include "tests/support/testing.h"

/// Comparisons of what result files hold.
namespace touchfield {
inline namespace support {

/// Equal to the last bit, NaN included.
template <class A, class B>
void expect_same_bits(const A& a, const B& b) {
  ASSERT_EQ(a.size(), b.size());
  if (a.size() > 0) {
    EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(*a.data()) * static_cast<std::size_t>(a.size())), 0);
  }
}

inline void expect_same_bits(double a, double b) { EXPECT_EQ(std::memcmp(&a, &b, sizeof(a)), 0) << a << " and " << b; }

/// Each value to the last bit.
template <class T, class... Value>
void expect_same_values(const T& a, const T& b, Value T::*... values) {
  (expect_same_bits(a.*values, b.*values), ...);
}

/// Each part by ==.
template <class T, class... Part>
void expect_equal_parts(const T& a, const T& b, Part T::*... parts) {
  EXPECT_EQ(std::tie(a.*parts...), std::tie(b.*parts...));
}

inline void expect_same(const PhaseSolution& a, const PhaseSolution& b) {
  using P = PhaseSolution;
  expect_equal_parts(a, b, &P::status, &P::iterations, &P::cost_history);
  expect_same_values(a, b, &P::phases, &P::amplitudes);
}

inline void expect_same(const Metrics& a, const Metrics& b) {
  for (const MetricField& field : metric_fields()) {
    SCOPED_TRACE(field.name);
    expect_same_bits(a.*field.value, b.*field.value);
  }
}

inline void expect_same(const TransducerArray& a, const TransducerArray& b) {
  using A = TransducerArray;
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.directivity.kind(), b.directivity.kind());
  expect_same_values(a, b, &A::positions, &A::axes, &A::amplitudes, &A::device, &A::channel);
  expect_same_values(a.response, b.response, &ChannelResponse::gain, &ChannelResponse::phase);
}

inline void expect_same(const ArrayTruth& a, const ArrayTruth& b) {
  EXPECT_EQ(a.phase_levels, b.phase_levels);
  expect_same_values(a.response, b.response, &ChannelResponse::gain, &ChannelResponse::phase);
}

inline void expect_same(const Provenance& a, const Provenance& b) {
  using P = Provenance;
  expect_equal_parts(a, b, &P::version, &P::revision, &P::compiler, &P::flags, &P::machine, &P::blas_core,
                     &P::instruction_level, &P::card, &P::threads, &P::seeds, &P::command_line, &P::start, &P::end,
                     &P::scene_hash);
}

inline void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  expect_same_bits(a.vertices(), b.vertices());
  expect_same_bits(a.triangles(), b.triangles());
  expect_same_bits(a.areas(), b.areas());
}

inline void expect_same(const Target& a, const Target& b) {
  expect_equal_parts(a, b, &Target::faces, &Target::box);
  expect_same_bits(a.amplitudes, b.amplitudes);
  ASSERT_EQ(a.boxes.size(), b.boxes.size());
  for (std::size_t i = 0; i < a.boxes.size(); ++i) {
    expect_equal_parts(a.boxes[i], b.boxes[i], &TargetBox::centre, &TargetBox::size, &TargetBox::rotation,
                       &TargetBox::shape, &TargetBox::level);
  }
}

inline void expect_same(const MethodResult& a, const MethodResult& b) {
  using M = MethodResult;
  expect_equal_parts(a, b, &M::name, &M::method, &M::scheme, &M::seconds);
  expect_same(a.solution, b.solution);
  expect_same_values(a, b, &M::pressure, &M::evaluation_pressure, &M::radiation, &M::shock_distance_share);
  expect_same(a.metrics, b.metrics);
}

inline void expect_same(const FieldResult& a, const FieldResult& b) {
  EXPECT_EQ(a.inside, b.inside);
  EXPECT_EQ(a.grid.name, b.grid.name);
  EXPECT_EQ(a.grid.count, b.grid.count);
  EXPECT_EQ(a.grid.origin, b.grid.origin);
  EXPECT_EQ(a.grid.spacing, b.grid.spacing);
  ASSERT_EQ(a.pressure.size(), b.pressure.size());
  for (std::size_t i = 0; i < a.pressure.size(); ++i) {
    EXPECT_EQ(a.pressure[i].first, b.pressure[i].first);
    expect_same_bits(a.pressure[i].second, b.pressure[i].second);
  }
}

inline void expect_same(const SolveRecord& a, const SolveRecord& b) {
  using S = SolveRecord;
  expect_equal_parts(a, b, &S::stage, &S::scheme, &S::solver, &S::precision, &S::unknowns, &S::right_hand_sides,
                     &S::steps, &S::refinements, &S::converged);
  expect_same_values(a, b, &S::residual, &S::seconds);
}

inline void expect_same(const RunTransfer& a, const RunTransfer& b) {
  using R = RunTransfer;
  using P = SkinProblem;
  expect_equal_parts(a.problem, b.problem, &P::target, &P::amplitudes, &P::weights, &P::outside);
  expect_equal_parts(a, b, &R::scheme, &R::incident);
  expect_same_values(a, b, &R::outside_weight, &R::channels_left_out, &R::outside_left_out);
}

inline void expect_same(const MotionFrame& a, const MotionFrame& b) {
  using F = MotionFrame;
  expect_equal_parts(a, b, &F::silent, &F::lost, &F::seconds);
  expect_same_values(a, b, &F::sampled, &F::started, &F::late, &F::shown, &F::pose_time, &F::target_off);
  ASSERT_EQ(a.joints.size(), b.joints.size());
  for (std::size_t j = 0; j < a.joints.size(); ++j) {
    expect_same_bits(a.joints[j], b.joints[j]);
  }
  expect_same_bits(a.off.skin, b.off.skin);
  expect_same_bits(a.off.patch, b.off.patch);
  expect_same(a.solution, b.solution);
}

inline void expect_same(const MotionScore& a, const MotionScore& b) {
  EXPECT_EQ(a.frame, b.frame);
  expect_same_values(a, b, &MotionScore::time, &MotionScore::age, &MotionScore::displacement);
  expect_same(a.metrics, b.metrics);
}

template <class T>
void expect_same(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE(i);
    expect_same(a[i], b[i]);
  }
}

template <class T>
void expect_same(const std::optional<T>& a, const std::optional<T>& b) {
  ASSERT_EQ(a.has_value(), b.has_value());
  if (a) {
    expect_same(*a, *b);
  }
}

inline void expect_same(const EvaluationModel& a, const EvaluationModel& b) {
  EXPECT_EQ(a.scheme, b.scheme);
  expect_same(a.mesh, b.mesh);
  expect_same(a.target, b.target);
}

inline void expect_same(const MotionMethod& a, const MotionMethod& b) {
  using M = MotionMethod;
  SCOPED_TRACE(a.name);
  expect_equal_parts(a, b, &M::name, &M::method, &M::scheme, &M::dropped);
  expect_same(a.frames, b.frames);
  expect_same(a.scores, b.scores);
  EXPECT_EQ(a.watched, b.watched);
}

inline void expect_same(const MotionInstant& a, const MotionInstant& b) {
  EXPECT_EQ(a.time, b.time);
  expect_same(a.mesh, b.mesh);
  expect_same(a.sensed, b.sensed);
  expect_same(a.target, b.target);
  EXPECT_EQ(a.pressure, b.pressure);
}

inline void expect_same(const MotionPatch& a, const MotionPatch& b) {
  expect_equal_parts(a, b, &MotionPatch::rate, &MotionPatch::radiation, &MotionPatch::points);
  EXPECT_EQ(a.skin.faces, b.skin.faces);
  EXPECT_EQ(a.skin.places, b.skin.places);
}

inline void expect_same(const Run& a, const Run& b) {
  expect_equal_parts(a, b, &Run::name, &Run::scene, &Run::evaluation, &Run::complete, &Run::seconds,
                     &Run::resonance_checks, &Run::warnings, &Run::notes, &Run::solved_skin);
  expect_same(a.provenance, b.provenance);
  expect_same(a.mesh, b.mesh);
  expect_same(a.array, b.array);
  expect_same(a.array_truth, b.array_truth);
  expect_same(a.target, b.target);
  expect_same(a.evaluation_model, b.evaluation_model);
  expect_same_bits(a.resonance_check, b.resonance_check);
  expect_same_bits(a.frequency, b.frequency);
  expect_same_bits(a.radiation_per_square, b.radiation_per_square);
  expect_same(a.solves, b.solves);
  expect_same(a.transfers, b.transfers);
  expect_same(a.methods, b.methods);
  expect_same(a.fields, b.fields);
}

inline void expect_same(const Motion& a, const Motion& b) {
  using M = Motion;
  expect_equal_parts(a, b, &M::name, &M::scene, &M::complete, &M::timings, &M::warnings, &M::notes, &M::solved_skin);
  expect_same_bits(a.seconds, b.seconds);
  expect_same(a.provenance, b.provenance);
  expect_same(a.array, b.array);
  expect_same(a.mesh, b.mesh);
  expect_same(a.evaluation, b.evaluation);
  expect_same(a.methods, b.methods);
  expect_same_bits(a.radiation_per_square, b.radiation_per_square);
  expect_same(a.instants, b.instants);
  expect_same(a.patch, b.patch);
}

}  // namespace support
}  // namespace touchfield
