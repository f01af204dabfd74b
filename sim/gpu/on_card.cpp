#include "sim/gpu/on_card.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/bem/grid_convolution.h"

namespace touchfield {

namespace {

std::vector<int> numbers(const std::vector<Eigen::Index>& faces) { return {faces.begin(), faces.end()}; }

GpuSolveOptions card_options(const SolverOptions& options, bool leaves_open) {
  GpuSolveOptions card;
  card.tolerance = options.tolerance;
  card.max_steps = options.max_steps;
  card.restart = options.restart;
  using Kind = GpuSolveOptions::Kind;
  card.kind = leaves_open                          ? Kind::kAuto
              : options.kind == SolverKind::kLu    ? Kind::kLu
              : options.kind == SolverKind::kGmres ? Kind::kGmres
              : options.kind == SolverKind::kFft   ? Kind::kFft
                                                   : Kind::kMatrixFree;
  return card;
}

/// For columns that are a basis.
GpuSolveOptions together(GpuSolveOptions options) {
  options.together = true;
  return options;
}

}  // namespace

GpuGrid card_grid(const GridBody& body, const Vector3& lowest, const ScatteringSystem& system) {
  const Complex wavenumber = system.wave().wavenumber();
  const double gamma = system.options().coupling / system.wave().k();
  const double tolerance = system.options().grid_tolerance;
  const GridSpec spec = choose_grid(body, wavenumber, gamma, tolerance).spec;
  const KernelSplit kernel(wavenumber, spec.reach, spec.shape);
  const KaiserWindow window(spec.width, spec.window_shape);
  GridAxes points{};
  for (std::size_t a = 0; a < points.size(); ++a) {
    points[a] = static_cast<int>(std::floor(body.extent(static_cast<Eigen::Index>(a)) / spec.step)) + spec.width;
  }
  const GridAxes period = grid_period(spec, body.extent, points);
  GpuGrid grid;
  grid.tolerance = tolerance;
  grid.step = spec.step;
  grid.reach = spec.reach;
  grid.width = spec.width;
  grid.lanes = window.lanes();
  grid.window = window.polynomials<float>();
  grid.local = kernel.local<float>(gamma);
  Eigen::Map<Vector3>(grid.origin) = lowest;
  std::copy(points.begin(), points.end(), grid.points);
  std::copy(period.begin(), period.end(), grid.period);
  const std::vector<Complex> symbol = grid_symbol(kernel, spec, body.extent, period);
  grid.symbol.assign(symbol.begin(), symbol.end());
  return grid;
}

GpuSources card_sources(const TransducerArray& array, const Eigen::VectorXcd& response) {
  GpuSources sources;
  sources.plane_wave = array.kind == TransducerArray::Kind::kPlaneWave;
  sources.count = static_cast<int>(array.size());
  sources.positions = array.positions.data();
  sources.axes = array.axes.data();
  sources.amplitudes = array.amplitudes.data();
  sources.response = array.response.as_designed() ? nullptr : response.data();
  sources.spline = array.directivity.spline();
  sources.intervals = Directivity::kIntervals;
  sources.interval = Directivity::kInterval;
  sources.piston_ka = array.directivity.ka();
  return sources;
}

GpuBodySpec card_surface(const TriangleMesh& mesh, const Wave& wave) {
  GpuBodySpec spec;
  spec.vertices = mesh.vertices().data();
  spec.vertex_count = static_cast<int>(mesh.vertex_count());
  spec.triangles = mesh.triangles().data();
  spec.faces = static_cast<int>(mesh.face_count());
  spec.k = wave.k();
  spec.alpha = wave.wavenumber().imag();
  return spec;
}

FarField far_field_on_card(Gpu& gpu, double far_distance, const TriangleMesh& mesh, const TransducerArray& array,
                           const Wave& wave, const Points& points, const Eigen::MatrixXcd& surface,
                           const Eigen::MatrixXcd& drive) {
  FarField far{Eigen::MatrixXcd(points.cols(), surface.cols()), Eigen::VectorXd(points.cols()),
               std::vector<int>(static_cast<std::size_t>(points.cols()))};
  const Eigen::VectorXcd response = factors(array.response);
  GpuField field;
  field.points = points.data();
  field.count = static_cast<int>(points.cols());
  field.surface = surface.data();
  field.drives = drive.data();
  field.columns = static_cast<int>(surface.cols());
  field.far_distance = far_distance;
  field.pressure = far.pressure.data();
  field.winding = far.winding.data();
  field.near = far.near.data();
  on_card([&] { gpu.field(card_surface(mesh, wave), card_sources(array, response), field); });
  return far;
}

/// Errors of the card as the program knows them.
template <typename Work>
auto BodyOnCard::guarded(const Work& work) const {
  try {
    return on_card(work);
  } catch (const std::domain_error& error) {
    throw NumericalError(fmt::format("scattering by {} faces, scheme {}, on {}: {}", system_.faces(),
                                     to_string(system_.scheme()), gpu_->info().name, error.what()));
  }
}

BodyOnCard::BodyOnCard(std::shared_ptr<Gpu> gpu, const ScatteringSystem& system, const SolverOptions& options,
                       bool leaves_open)
    : gpu_(std::move(gpu)),
      system_(system),
      box_{system.mesh().centroids().rowwise().minCoeff(), grid_body(system.mesh())},
      options_(card_options(options, leaves_open)) {
  const SchemeTraits& scheme = traits(system.scheme());
  if (scheme.interior_points) {
    throw std::invalid_argument("BodyOnCard: a scheme with interior points");
  }
  const FaceRule& rule = system.options().rule;
  GpuBodySpec spec = card_surface(system.mesh(), system.wave());
  spec.coupling = system.options().coupling;
  spec.burton_miller = scheme.burton_miller;
  spec.corrected = scheme.corrected;
  spec.polished = scheme.polished;
  spec.split_ratio = rule.split_ratio;
  spec.seven_below = rule.seven_below;
  spec.three_below = rule.three_below;
  if (system.options().grid_tolerance >= kFinestSingleGrid) {
    spec.grid = [this] { return card_grid(box_.body, box_.lowest, system_); };
  }
  body_ = guarded([&] { return gpu_->body(spec); });
}

void BodyOnCard::aim(const TransducerArray& array) {
  const Eigen::VectorXcd response = factors(array.response);
  guarded([&] { body_->set_sources(card_sources(array, response)); });
}

SolveReport BodyOnCard::reported(const GpuSolveReport& report) {
  using Kind = GpuSolveOptions::Kind;
  kind_ = report.kind == Kind::kLu      ? SolverKind::kLu
          : report.kind == Kind::kGmres ? SolverKind::kGmres
          : report.kind == Kind::kFft   ? SolverKind::kFft
                                        : SolverKind::kMatrixFree;
  return {report.steps, 0, report.residual, report.converged};
}

Solved BodyOnCard::pressure(const TransducerArray& array, const Eigen::MatrixXcd& drives,
                            const ScatteringSolver::Report& report) {
  aim(array);
  spanned_columns_ = 0;
  drives_.reset();
  Solved solved;
  solved.x.resize(system_.faces(), drives.cols());
  guarded([&] {
    solved.report = reported(body_->solve(drives.data(), static_cast<int>(drives.cols()), false, options_, report));
    body_->pressures(solved.x.data());
  });
  return solved;
}

void BodyOnCard::take(Eigen::Index channels, const Wanted& wanted, Spanned& spanned) {
  spanned_columns_ = static_cast<int>(spanned.drives);
  const auto count = static_cast<int>(wanted.faces.size());
  spanned.target.resize(count, channels);
  body_->rows(numbers(wanted.faces).data(), count, spanned.target.data());
  spanned.outside.resize(0, channels);
  if (wanted.weights != nullptr) {
    const GpuBody::Reduction reduction = body_->reduce(wanted.weights->data(), wanted.tolerance);
    spanned.outside.resize(reduction.rank, channels);
    spanned.outside_left_out = reduction.left_out;
    body_->reduced(spanned.outside.data());
  }
}

BodyOnCard::Spanned BodyOnCard::spanned(const TransducerArray& array, double tolerance, const Wanted& wanted,
                                        const ScatteringSolver::Report& report) {
  aim(array);
  drives_.reset();
  Spanned spanned;
  guarded([&] {
    const GpuBody::Span span = body_->span(tolerance, together(options_), report);
    spanned.drives = span.rank;
    spanned.left_out = span.left_out;
    spanned.report = reported(span.report);
    take(array.size(), wanted, spanned);
  });
  return spanned;
}

BodyOnCard::Spanned BodyOnCard::spanned(const TransducerArray& array,
                                        const std::shared_ptr<const Eigen::MatrixXcd>& drives, const Wanted& wanted,
                                        const ScatteringSolver::Report& report) {
  aim(array);
  const bool is_there = std::exchange(drives_, nullptr) == drives;
  Spanned spanned;
  spanned.drives = drives->cols();
  const auto columns = static_cast<int>(drives->cols());
  guarded([&] {
    spanned.report = reported(body_->solve(is_there ? nullptr : drives->data(), columns, columns == spanned_columns_,
                                           together(options_), report));
    take(array.size(), wanted, spanned);
  });
  drives_ = drives;
  return spanned;
}

Eigen::MatrixXcd BodyOnCard::spanned_pressure() const {
  Eigen::MatrixXcd pressure(system_.faces(), spanned_columns_);
  guarded([&] { body_->pressures(pressure.data()); });
  return pressure;
}

IncidentProblem BodyOnCard::incident_problem(const TransducerArray& array, const std::vector<Eigen::Index>& faces,
                                             const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& weights,
                                             const Eigen::MatrixXcd& beyond, bool scattered) {
  aim(array);
  const auto size = static_cast<Eigen::Index>(faces.size()) + array.size();
  Eigen::MatrixXcd more;
  if (beyond.size() > 0) {
    more = Eigen::MatrixXcd::Zero(size, size);
    more.bottomRightCorner(array.size(), array.size()) = beyond;
  }
  IncidentProblem problem{{}, static_cast<Eigen::Index>(faces.size())};
  guarded([&] {
    problem.device = body_->incident_gram(numbers(faces).data(), static_cast<int>(faces.size()), amplitudes.data(),
                                          weights.data(), more.size() > 0 ? more.data() : nullptr, scattered);
  });
  return problem;
}

Solved BodyOnCard::transfer_rows(const TransducerArray& array, const std::vector<Eigen::Index>& faces,
                                 const ScatteringSolver::Report& report) {
  aim(array);
  spanned_columns_ = 0;
  Solved solved;
  solved.x.resize(static_cast<Eigen::Index>(faces.size()), array.size());
  guarded([&] {
    solved.report = reported(
        body_->transfer_rows(numbers(faces).data(), static_cast<int>(faces.size()), solved.x.data(), options_, report));
  });
  return solved;
}

void BodyOnCard::move(const TriangleMesh& mesh) {
  box_ = {mesh.centroids().rowwise().minCoeff(), grid_body(mesh)};
  guarded([&] { body_->move(mesh.vertices().data()); });
}

}  // namespace touchfield
