#pragma once

#include <functional>
#include <string>

#include "sim/acoustics/medium.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// What this machine does now, on all threads, for estimates: measured in a few hundredths of a second.

/// Seconds of one product without near corrections in single precision, one right-hand side.
double product_seconds(const TriangleMesh& mesh, const Wave& wave);

/// Floating-point operations per second, and what a reader of an estimate must know about them.
struct Speed {
  double flops = 0;
  std::string note;  // empty, or why this is a guess
};

/// The fastest of two trials of the given work: operations / seconds. Work that fails or takes no time that can be
/// measured gives a guess of 1e10 per thread and a note, never an error.
Speed speed_of(const std::function<void()>& work, double operations);

/// Rows of the largest LU that is timed: of about half a second.
inline constexpr double kTimedRows = 1600;

/// The speed of an LU of about that many rows, at most kTimedRows. An estimate thus takes no longer than the work that
/// it is for. Each size is measured once per process.
const Speed& measured_speed(double rows);

}  // namespace touchfield
