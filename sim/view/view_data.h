#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sim/acoustics/transducer_array.h"
#include "sim/core/types.h"
#include "sim/field/target.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// The skin at one time.
struct ViewSkin {
  double time = 0;  // [s]
  TriangleMesh mesh;
  std::optional<TriangleMesh> sensed{};      // as a sensor saw it
  std::optional<Target> target{};            // on `mesh`
  std::vector<Eigen::VectorXcd> pressure{};  // per method, on the faces [Pa]; empty: not known
  std::vector<Eigen::VectorXd> radiation{};  // likewise [Pa]
};

/// A line over time in a diagram that all lines of its label share.
struct ViewCurve {
  std::string label;           // with the unit
  std::string line;            // whose it is
  std::vector<double> times;   // [s]
  std::vector<double> values;  // NaN breaks the line
};

struct ViewMethod {
  std::string name;
  std::string caption{};  // figures below the name
};

/// What a page shows.
struct ViewData {
  std::string title;
  std::vector<ViewMethod> methods;
  TransducerArray array;
  double radiation_per_square = kNotComputed;  // of the air (metrics.h) [1/Pa]; NaN: no radiation pressure is shown
  std::vector<ViewSkin> skins;                 // in the order of their times
  std::vector<FieldResult> fields{};           // of which planes are shown
  std::vector<ViewCurve> curves{};
};

}  // namespace touchfield
