#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "tests/support/sphere_support.h"
#include "tests/support/table_row.h"

namespace touchfield {

/// How large a case is: small ones run with every test, full ones under the label `long` and into docs/stability.md.
enum class Size { kSmall, kFull };

inline void PrintTo(Size size, std::ostream* out) { *out << (size == Size::kSmall ? "small" : "full"); }

/// Cases that run in both sizes. Each prints the rows of a table.
class HardCase : public testing::TestWithParam<Size> {
 protected:
  template <typename Value>
  static Value sized(Value small, Value full) {
    return GetParam() == Size::kSmall ? small : full;
  }
};

/// Air at 20 C.
Wave wave_at(double frequency);

/// What one scheme says of one problem.
struct Answer {
  Eigen::VectorXcd pressure;  // M
  SolveReport report;
  double rcond = 0;         // of LU
  int two_level_steps = 0;  // of the same problem by GMRES with the preconditioner; of Burton-Miller in answers()
};
using Answers = std::map<Scheme, Answer>;

/// Burton-Miller by matrix-free GMRES in single precision, refined; the others, for which a hand needs hundreds of
/// steps, by LU, refined: chief in double precision, which its matrix of a coarse hand takes.
SolverOptions usual_solver(Scheme scheme);

/// The surface pressure with every channel driven by 1. `answers` also prints which scheme has not converged. It solves
/// Burton-Miller's equation with the preconditioner too, which must change nothing.
Answer answer(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array, Scheme scheme,
              const SolverOptions& options);
Answers answers(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                const std::vector<Scheme>& schemes = all_schemes());

/// The pressure at the mesh's centroids by the polished scheme on the mesh with every face split in four, `times` over.
Eigen::VectorXcd split_reference(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                                 int times = 1);

/// Weights (areas) of the faces whose centroid and normal are as asked; 0 elsewhere.
template <typename Predicate>
Eigen::VectorXd area_where(const TriangleMesh& mesh, const Predicate& is_in) {
  Eigen::VectorXd weights = mesh.areas();
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (!is_in(Vector3(mesh.centroids().col(f)), Vector3(mesh.normals().col(f)))) {
      weights(f) = 0;
    }
  }
  return weights;
}

/// sqrt(w . |p - exact|^2 / w . |exact|^2)
double error(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact);
/// The same of absolute values.
double amplitude_error(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p, const Eigen::VectorXcd& exact);
/// sqrt(w . |p|^2 / sum w)
double mean_amplitude(const Eigen::VectorXd& weights, const Eigen::VectorXcd& p);

using Errors = std::map<Scheme, double>;
Errors errors(const Eigen::VectorXd& weights, const Answers& answers, const Eigen::VectorXcd& exact);

/// The scheme as docs/stability.md spells it.
std::string letters(Scheme scheme);

/// Edges a wavelength and faces.
Cells mesh_cells(const TriangleMesh& mesh, const Wave& wave);
/// A column for each scheme: its figures in percent, ` / ` between them.
Cells scheme_cells(const std::vector<Errors>& figures);
/// GMRES steps of Burton-Miller, without and with the preconditioner.
Cells step_cells(const Answers& answers);

/// The finger of these cases: a capsule of radius 8 mm, 36 mm long.
TriangleMesh finger(double edge);

/// Two copies of a mesh side by side in x, `gap` [m] between their outermost vertices.
TriangleMesh pair_of(const TriangleMesh& mesh, double gap);

/// The same flat surface with every fourth face cut in three about a point that leaves the angle [rad]: over the middle
/// of a side and next to a corner in turn.
TriangleMesh with_slivers(const TriangleMesh& mesh, double angle);

/// Sphere whose edges grow from `finest` at the pole +z by `growth` a metre of distance from it, up to `coarsest`;
/// scaled to the sphere's volume.
TriangleMesh graded_sphere(double radius, double finest, double coarsest, double growth);

/// A tube along z, closed at the bottom, the rim and the outer corner round: inner radius 4.5 mm, depth 25 mm, wall
/// 2.5 mm. Its floor is the plane z = 0 inside.
TriangleMesh cup(double edge);
constexpr double kCupRadius = 4.5e-3;
constexpr double kCupDepth = 25e-3;

}  // namespace touchfield
