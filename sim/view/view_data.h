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

/// Values on the faces that a page shows in place of |p|, its level, its phase and P.
struct ViewQuantity {
  std::string name;
  std::string unit;
  double factor;                          // from SI to the unit
  std::vector<Eigen::VectorXd> values{};  // per method [SI]; NaN is grey
};

/// The skin at one time.
struct ViewSkin {
  double time = 0;  // [s]
  TriangleMesh mesh;
  std::optional<TriangleMesh> sensed{};      // as a sensor saw it
  std::optional<Target> target{};            // on `mesh`
  std::vector<Eigen::VectorXcd> pressure{};  // per method, on the faces [Pa]; empty: not known
  std::vector<Eigen::VectorXd> radiation{};  // likewise [Pa]
  std::vector<ViewQuantity> quantities{};    // the page's own; empty: it has those of sound
  Points border{};                           // without a target: lines round what the page shows first, 3 x 2 E [m]
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
