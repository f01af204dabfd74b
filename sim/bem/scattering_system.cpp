#include "sim/bem/scattering_system.h"

#include <numbers>
#include <stdexcept>
#include <utility>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/grid_spec.h"
#include "sim/bem/grid_sum.h"
#include "sim/mesh/query/interior_points.h"
#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

constexpr double kChiefEdges = 0.5;  // of the nearest face: for a nearer point one point does not stand for the face

Eigen::VectorXcd burton_miller_diagonal(const TriangleMesh& mesh, const Complex& wavenumber, double gamma) {
  Eigen::VectorXcd diagonal(mesh.face_count());
#pragma omp parallel for schedule(static)
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    diagonal(f) = 0.5 - Complex(0, gamma) * self_integrals(face_of(mesh, f), wavenumber).hypersingular;
  }
  return diagonal;
}

/// One layer's product with near integrals done by the rule; the self terms are the caller's.
Eigen::MatrixXcd layer_product(const ScatteringSystem& system, Layer layer, const Eigen::MatrixXcd& x) {
  const Complex wavenumber = system.wave().wavenumber();
  Eigen::MatrixXcd y = system.sums().apply(layer, x);
  const bool rough = system.options().grid_tolerance >= kFinestSingleGrid;
  const auto numbers = rough ? NearCorrections::Numbers::kSingle : NearCorrections::Numbers::kDouble;
  NearCorrections(system.mesh(), wavenumber, 0.0, layer, system.options().rule, numbers).add_product(1.0, x, y);
  return y;
}

}  // namespace

IncidentField driven(const IncidentField& unit, const Eigen::MatrixXcd& drive) {
  const auto times = [&](const Eigen::MatrixXcd& g) -> Eigen::MatrixXcd {
    return g.size() > 0 ? matrix_product(g, drive) : Eigen::MatrixXcd(g.rows(), drive.cols());
  };
  return {times(unit.pressure), times(unit.slope), times(unit.interior)};
}

ScatteringSystem::ScatteringSystem(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SystemOptions& options)
    : mesh_(std::move(mesh)), wave_(wave), scheme_(scheme), options_(options) {
  if (traits(scheme).interior_points) {
    interior_ = spaced_interior_points(mesh_, options_.chief_spacing * wave_.wavelength(),
                                       options_.chief_clearance * wave_.wavelength(), kChiefEdges);
    chief_rows_ = -LayerSum<double>(mesh_, wave_.wavenumber(), 0.0).rows(Layer::kDouble, interior_);
    chief_scale_ = chief_rows_.rowwise().norm().cwiseInverse();
    chief_rows_ = chief_scale_.asDiagonal() * chief_rows_;
  }
}

const ScatteringSystem::Operators& ScatteringSystem::operators() const {
  std::call_once(*once_, [this] { operators_ = make_operators(); });
  return operators_;
}

ScatteringSystem::Operators ScatteringSystem::make_operators() const {
  Operators made;
  const bool by_grid = options_.grid_tolerance > 0;
  Eigen::VectorXcd corrected;
  const bool needs_corrected = traits(scheme_).corrected || traits(scheme_).polished;
  if (by_grid) {
    const GridSpec spec = choose_grid(grid_body(mesh_), wave_.wavenumber(), gamma(), options_.grid_tolerance).spec;
    if (needs_corrected) {  // its grid is gone before the other is made
      corrected = gauss_diagonal(*make_grid_sums(mesh_, 0.0, 0.0, spec)).cast<Complex>();
    }
    made.sums = make_grid_sums(mesh_, wave_.wavenumber(), gamma(), spec);
  } else {
    if (needs_corrected) {
      corrected = gauss_diagonal(mesh_).cast<Complex>();
    }
    made.sums = std::make_shared<LayerSum<double>>(mesh_, wave_.wavenumber(), gamma());
  }
  if (traits(scheme_).burton_miller) {
    const bool rough = by_grid && options_.grid_tolerance >= kFinestSingleGrid;
    const auto numbers = rough ? NearCorrections::Numbers::kSingle : NearCorrections::Numbers::kDouble;
    made.near = std::make_shared<NearCorrections>(mesh_, wave_.wavenumber(), gamma(), Layer::kBurtonMiller,
                                                  options_.rule, numbers);
    made.parts = {Layer::kBurtonMiller, gamma(), burton_miller_diagonal(mesh_, wave_.wavenumber(), gamma()), made.near};
  } else if (traits(scheme_).corrected) {
    made.parts = {Layer::kDouble, 0.0, corrected, nullptr};
  } else {
    made.parts = {Layer::kDouble, 0.0, Eigen::VectorXcd::Constant(faces(), 0.5), nullptr};
  }
  if (traits(scheme_).polished && by_grid) {
    made.polisher = std::make_unique<SummedOperator>(made.sums, polishing_parts(corrected));
  } else if (traits(scheme_).polished) {
    made.polisher = std::make_unique<BoundaryOperator<float>>(mesh_, wave_.wavenumber(), polishing_parts(corrected));
  }
  if (by_grid) {
    made.by_grid = with_interior_points(std::make_unique<SummedOperator>(made.sums, made.parts));
  }
  made.exact = make_operator<double>(made.parts);
  return made;
}

double ScatteringSystem::gamma() const { return options_.coupling / wave_.k(); }

std::unique_ptr<LinearOperator> ScatteringSystem::with_interior_points(std::unique_ptr<LinearOperator> b) const {
  if (traits(scheme_).interior_points) {
    return std::make_unique<ChiefOperator>(std::move(b), chief_rows_);
  }
  return b;
}

template <typename Real>
std::unique_ptr<LinearOperator> ScatteringSystem::make_operator(const BoundaryParts& parts) const {
  return with_interior_points(std::make_unique<BoundaryOperator<Real>>(mesh_, wave_.wavenumber(), parts));
}

const LinearOperator& ScatteringSystem::by_grid() const {
  if (!operators().by_grid) {
    throw std::invalid_argument("ScatteringSystem: products by a grid need a grid_tolerance");
  }
  return *operators().by_grid;
}

std::unique_ptr<LinearOperator> ScatteringSystem::single_operator() const {
  return make_operator<float>(operators().parts);
}

std::unique_ptr<const TwoLevel> ScatteringSystem::two_level() const {
  if (!traits(scheme_).burton_miller) {
    return nullptr;
  }
  return std::make_unique<TwoLevel>(mesh_, wave_.wavenumber(), options_.coupling, operators().parts);
}

template <typename Real>
Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic> ScatteringSystem::make_dense() const {
  using Matrix = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;
  const BoundaryOperator<Real> b(mesh_, wave_.wavenumber(), operators().parts);
  Matrix matrix = b.dense();
  if (traits(scheme_).interior_points) {
    const Matrix c = chief_rows_.cast<std::complex<Real>>();
    Matrix square(faces(), faces());
    multiply(Op::kAdjoint, c, Op::kPlain, c, square);
    matrix += square;
  }
  return matrix;
}

Eigen::MatrixXcd ScatteringSystem::dense() const { return make_dense<double>(); }

Eigen::MatrixXcf ScatteringSystem::dense_single() const { return make_dense<float>(); }

IncidentField ScatteringSystem::incident(const TransducerArray& array) const {
  IncidentField field;
  field.pressure = incident_matrix(array, wave_, mesh_.centroids());
  field.slope.resize(0, array.size());
  if (traits(scheme_).burton_miller) {
    field.slope = incident_derivative_matrix(array, wave_, mesh_.centroids(), mesh_.normals());
  }
  field.interior = incident_matrix(array, wave_, interior_);
  return field;
}

IncidentField ScatteringSystem::incident(const TransducerArray& array, const Eigen::MatrixXcd& drive,
                                         bool single) const {
  IncidentField field;
  field.pressure = incident_pressure(array, wave_, mesh_.centroids(), drive, single);
  field.slope.resize(0, drive.cols());
  if (traits(scheme_).burton_miller) {
    field.slope = incident_derivative(array, wave_, mesh_.centroids(), mesh_.normals(), drive, single);
  }
  field.interior = incident_pressure(array, wave_, interior_, drive, single);
  return field;
}

Eigen::MatrixXcd ScatteringSystem::right_hand_side(const IncidentField& incident) const {
  if (traits(scheme_).burton_miller) {
    return incident.pressure + Complex(0, gamma()) * incident.slope;
  }
  if (traits(scheme_).interior_points) {
    return incident.pressure + chief_rows_.adjoint() * (chief_scale_.asDiagonal() * incident.interior);
  }
  return incident.pressure;
}

Eigen::MatrixXcd ScatteringSystem::right_hand_side_rows(const TransducerArray& array,
                                                        const std::vector<Eigen::Index>& rows) const {
  const Points points = mesh_.centroids()(Eigen::all, rows);
  const Eigen::MatrixXcd b = incident_matrix(array, wave_, points);
  if (traits(scheme_).burton_miller) {
    return b +
           Complex(0, gamma()) * incident_derivative_matrix(array, wave_, points, mesh_.normals()(Eigen::all, rows));
  }
  if (traits(scheme_).interior_points) {
    return b + chief_rows_(Eigen::all, rows).adjoint() *
                   (chief_scale_.asDiagonal() * incident_matrix(array, wave_, interior_));
  }
  return b;
}

Eigen::MatrixXcf ScatteringSystem::right_hand_side_single(const TransducerArray& array,
                                                          Eigen::MatrixXcf& incident) const {
  const Eigen::MatrixXcf pressure = incident_matrix_single(array, wave_, mesh_.centroids());
  if (traits(scheme_).burton_miller) {
    incident = pressure;
    return pressure + std::complex<float>(0, static_cast<float>(gamma())) *
                          incident_derivative_matrix_single(array, wave_, mesh_.centroids(), mesh_.normals());
  }
  Eigen::MatrixXcf b(faces() + interior_.cols(), array.size());
  b.topRows(faces()) = pressure;
  if (interior_.cols() > 0) {
    b.bottomRows(interior_.cols()) =
        chief_scale_.cast<std::complex<float>>().asDiagonal() * incident_matrix_single(array, wave_, interior_);
  }
  return b;
}

Eigen::MatrixXcd ScatteringSystem::pressure(const Eigen::MatrixXcd& solution, const IncidentField& incident) const {
  Eigen::MatrixXcd p = solution;
  if (operators().polisher) {
    for (int step = 0; step < kPolishingSteps; ++step) {
      p += incident.pressure - operators().polisher->apply(p);
    }
  }
  return p;
}

Eigen::MatrixXcd ScatteringSystem::transposed_right_hand_side(const Eigen::MatrixXcd& weights) const {
  Eigen::MatrixXcd r = weights;
  if (operators().polisher) {  // H = (1 - B_c)^2 H_BM + (2 - B_c) G
    for (int step = 0; step < kPolishingSteps; ++step) {
      r -= operators().polisher->apply_transpose(r);
    }
  }
  return r;
}

Eigen::MatrixXcd ScatteringSystem::weighted_rows(const Eigen::MatrixXcd& weights, const Eigen::MatrixXcd& x,
                                                 const IncidentField& unit) const {
  // b's parts one by one: b itself for N channels would be another M x N matrix.
  Eigen::MatrixXcd rows = x.transpose() * unit.pressure;
  if (traits(scheme_).burton_miller) {
    rows += Complex(0, gamma()) * (x.transpose() * unit.slope);
  }
  if (traits(scheme_).interior_points) {
    rows += (chief_scale_.asDiagonal() * (chief_rows_.conjugate() * x)).transpose() * unit.interior;
  }
  if (operators().polisher) {
    rows += (2.0 * weights - operators().polisher->apply_transpose(weights)).transpose() * unit.pressure;
  }
  return rows;
}

Eigen::MatrixXcd ScatteringSystem::columns(const std::vector<Eigen::Index>& faces) const {
  const Eigen::MatrixXcd b = BoundaryOperator<double>(mesh_, wave_.wavenumber(), operators().parts).columns(faces);
  if (traits(scheme_).interior_points) {
    return b + chief_rows_.adjoint() * chief_rows_(Eigen::all, faces);
  }
  return b;
}

SourceField source_field(const TriangleMesh& mesh, const Wave& wave, const Points& sources) {
  SourceField field{Eigen::MatrixXcd(mesh.face_count(), sources.cols()),
                    Eigen::MatrixXcd(mesh.face_count(), sources.cols())};
  const Complex ik = Complex(0, 1) * wave.wavenumber();
#pragma omp parallel for schedule(static)
  for (Eigen::Index s = 0; s < sources.cols(); ++s) {
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const Vector3 offset = mesh.centroids().col(f) - sources.col(s);
      const double r = offset.norm();
      const Complex g = std::exp(ik * r) / (4.0 * std::numbers::pi * r);
      field.value(f, s) = g;
      field.slope(f, s) = (ik - 1.0 / r) * g * (offset.dot(mesh.normals().col(f)) / r);
    }
  }
  return field;
}

IncidentField interior_incident(const ScatteringSystem& system, const SourceField& field) {
  const TriangleMesh& mesh = system.mesh();
  const Complex wavenumber = system.wave().wavenumber();
  IncidentField incident;
  incident.pressure = -layer_product(system, Layer::kSingle, field.slope);
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    incident.pressure.row(f) -= self_integrals(face_of(mesh, f), wavenumber).single * field.slope.row(f);
  }
  incident.slope = -0.5 * field.slope - layer_product(system, Layer::kAdjoint, field.slope);
  incident.interior =
      -LayerSum<double>(mesh, wavenumber, 0.0).rows(Layer::kSingle, system.interior_points()) * field.slope;
  return incident;
}

}  // namespace touchfield
