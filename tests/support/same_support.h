#pragma once

#include <cstring>

#include <gtest/gtest.h>

#include "sim/store/run_data.h"

/// Comparisons of what result files hold.
namespace touchfield::support {

/// Equal to the last bit, NaN included.
template <class A, class B>
inline void expect_same_bits(const A& a, const B& b) {
  ASSERT_EQ(a.size(), b.size());
  if (a.size() > 0) {
    EXPECT_EQ(std::memcmp(a.data(), b.data(), sizeof(*a.data()) * static_cast<std::size_t>(a.size())), 0);
  }
}

inline void expect_same_bits(double a, double b) { EXPECT_EQ(std::memcmp(&a, &b, sizeof(a)), 0) << a << " and " << b; }

inline void expect_same(const PhaseSolution& a, const PhaseSolution& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.cost_history, b.cost_history);
  expect_same_bits(a.phases, b.phases);
  expect_same_bits(a.amplitudes, b.amplitudes);
}

inline void expect_same(const Metrics& a, const Metrics& b) {
  for (const MetricField& field : metric_fields()) {
    SCOPED_TRACE(field.name);
    expect_same_bits(a.*field.value, b.*field.value);
  }
}

inline void expect_same(const TransducerArray& a, const TransducerArray& b) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.directivity.kind(), b.directivity.kind());
  expect_same_bits(a.positions, b.positions);
  expect_same_bits(a.axes, b.axes);
  expect_same_bits(a.amplitudes, b.amplitudes);
  expect_same_bits(a.device, b.device);
  expect_same_bits(a.channel, b.channel);
}

inline void expect_same(const Provenance& a, const Provenance& b) {
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.revision, b.revision);
  EXPECT_EQ(a.compiler, b.compiler);
  EXPECT_EQ(a.flags, b.flags);
  EXPECT_EQ(a.machine, b.machine);
  EXPECT_EQ(a.blas_core, b.blas_core);
  EXPECT_EQ(a.instruction_level, b.instruction_level);
  EXPECT_EQ(a.threads, b.threads);
  EXPECT_EQ(a.seeds, b.seeds);
  EXPECT_EQ(a.command_line, b.command_line);
  EXPECT_EQ(a.start, b.start);
  EXPECT_EQ(a.end, b.end);
  EXPECT_EQ(a.scene_hash, b.scene_hash);
}

inline void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  expect_same_bits(a.vertices(), b.vertices());
  expect_same_bits(a.triangles(), b.triangles());
  expect_same_bits(a.areas(), b.areas());
}

}  // namespace touchfield::support
