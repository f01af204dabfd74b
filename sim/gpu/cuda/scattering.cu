#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "sim/gpu/cuda/scattering.cuh"

namespace touchfield::cuda {

namespace {

constexpr std::size_t kMostPanelBytes = std::size_t{4} << 30U;
constexpr int kUsualSteps = 60;       // of GMRES, for which a block's Krylov space must have room
constexpr double kTf32Error = 3e-4;   // of a product in TF32
constexpr double kShareOfFree = 0.8;  // of what is free that one thing may take
constexpr int kFacesAColumn = 64;     // at most, for LU and its inverse to take less than the steps of GMRES
constexpr int kMostSteps = 20;        // by an inverse that is worth keeping
// A product by a grid takes less than rows of B: for a column of at least so many faces, for any number of them with more.
constexpr int kGridFacesAColumn = 2'000;
constexpr int kGridFacesOfMany = 150'000;
constexpr int kMostTwoLevelSteps = 40;  // by a two-level preconditioner: beyond, the solution goes on without
constexpr int kManyTwoLevelSteps = 12;  // beyond, one of where the body was is made anew
constexpr int kTwoLevelSteps = 10;      // expected
constexpr int kTrialSteps = 4;          // from which on GMRES without it tells how many steps it takes

// Seconds that an H200 takes: a product by a grid, of one by rows of B, with many columns, and to make a two-level
// preconditioner. Only their ratios matter.
constexpr double kGridSeconds = 2e-8;          // per face and column
constexpr double kRowSeconds = 3e-12;          // per pair of faces
constexpr double kRowColumnSeconds = 1.6e-13;  // per pair and column
constexpr double kTwoLevelSeconds = 0.05;
constexpr double kTwoLevelFaceSeconds = 2e-7;
constexpr double kLeastGain = 1e-3;  // of the logarithm of a residual per step: less counts as that

constexpr double kGridShare = 0.55;  // of the tolerance that GMRES is to reach, whose products are off by a tenth of it

}  // namespace

Scattering::Scattering(Context& context, const GpuBodySpec& spec)
    : context_(context),
      spec_(spec),
      faces_(context, spec.triangles, spec.faces, spec.vertices, spec.vertex_count,
             SurfaceWave{spec.k, spec.alpha, spec.burton_miller ? spec.coupling / spec.k : 0.0}) {}

void Scattering::move(const double* vertices) {
  context_.use();
  faces_.move(vertices);
  leave_grid();
  has_field_ = false;
  factors_are_current_ = false;
  two_level_is_current_ = false;
  if (boundary_) {
    boundary_->update();
  }
  if (plain_) {
    plain_->update();
  }
}

void Scattering::set_sources(const GpuSources& given) {
  context_.use();
  sources_ = std::make_unique<Sources>(context_, spec_.k, spec_.alpha, given);
  has_field_ = false;
}

const Sources& Scattering::sources() const {
  if (!sources_) {
    throw std::logic_error("a body on the card without an array");
  }
  return *sources_;
}

/// Of rows that a product makes at once: more take memory from what is solved for and gain nothing.
std::size_t Scattering::panel_bytes() const {
  return std::min(kMostPanelBytes, (context_.allowed() - context_.taken()) / 8);
}

Boundary& Scattering::made(std::unique_ptr<Boundary>& boundary, Equation equation) {
  if (!boundary) {
    const NearRule rule{spec_.split_ratio, spec_.seven_below, spec_.three_below};
    boundary = std::make_unique<Boundary>(faces_, equation, BoundaryOptions{rule, panel_bytes()});
    boundary->go_through(grid_.get());
  }
  return *boundary;
}

Boundary& Scattering::boundary() {
  return made(boundary_, spec_.burton_miller ? Equation::kBurtonMiller
                         : spec_.corrected   ? Equation::kPaperCorrected
                                             : Equation::kPaper);
}

/// g_ and, of Burton-Miller, b_ in single precision.
void Scattering::make_field() {
  if (has_field_) {
    return;
  }
  const std::size_t size = std::size_t{1} * spec_.faces * sources().size();
  g_.resize(size);
  sources().incident(faces_.centroids(), nullptr, spec_.faces, g_.data());
  if (spec_.burton_miller) {
    Array<cuComplex> slope(context_, size);
    b_.resize(size);
    sources().incident(faces_.centroids(), faces_.normals(), spec_.faces, slope.data());
    copy(g_.data(), b_.data(), size);
    add(context_, {0.0F, static_cast<float>(gamma())}, slope.data(), b_.data(), size);
  }
  has_field_ = true;
}

void Scattering::copy(const cuComplex* from, cuComplex* to, std::size_t count) {
  check(cudaMemcpyAsync(to, from, count * sizeof(cuComplex), cudaMemcpyDeviceToDevice, context_.stream()), "copy");
}

bool Scattering::fits(double bytes) const {
  return bytes <= kShareOfFree * static_cast<double>(context_.allowed() - context_.taken());
}

void Scattering::factorise() {
  if (has_current_factors()) {
    return;
  }
  has_factors_ = false;
  const std::size_t size = std::size_t{1} * spec_.faces * spec_.faces;
  factors_.resize(size);
  if (boundary().is_stored()) {
    copy(boundary().stored(), factors_.data(), size);
  } else {
    boundary().fill_rows({0, spec_.faces}, factors_.data(), spec_.faces);
  }
  lu_.factorise(spec_.faces, factors_.data());
  has_factors_ = factors_are_current_ = true;
}

void Scattering::drop_factors() {
  factors_.reset();
  has_factors_ = false;
}

bool Scattering::is_wide(int columns) const { return kFacesAColumn * columns >= spec_.faces; }

/// The inverse from the factors of B, where so many columns repay it: it preconditions the Bs that follow as the body
/// moves. All that is only for speed: where memory does not bear it, nothing is made.
void Scattering::invert_for(int columns) {
  if (!spec_.burton_miller || !has_factors_ || !is_wide(columns) || !fits(matrix_bytes())) {
    return;
  }
  try {
    invert();
  } catch (const GpuMemoryFailure&) {
    inverse_.reset();
  }
}

void Scattering::invert() {
  std::vector<int> all(static_cast<std::size_t>(spec_.faces));
  std::iota(all.begin(), all.end(), 0);
  set_units(all.data(), spec_.faces, inverse_);
  lu_.solve(CUBLAS_OP_N, spec_.faces, inverse_.data());
  drop_factors();
}

bool Scattering::grid_pays(int columns) {
  return spec_.grid &&
         (columns <= std::max(kFewColumns, spec_.faces / kGridFacesAColumn) || spec_.faces >= kGridFacesOfMany);
}

void Scattering::go_through_grid() {
  boundary().forget();
  drop_factors();
  inverse_.reset();
  if (!grid_) {
    grid_ = std::make_unique<GridSums>(faces_, spec_.grid());
  }
  boundary().go_through(grid_.get());
  if (plain_) {
    plain_->go_through(grid_.get());
  }
}

void Scattering::leave_grid() {
  for (const auto* boundary : {&boundary_, &plain_}) {
    if (*boundary) {
      (*boundary)->go_through(nullptr);
    }
  }
  grid_.reset();
}

/// How so many columns are solved for best, and made ready for that. Plain schemes need LU, since their B has
/// eigenvalues near 0; the others' has not, but for many columns LU takes less than the steps without it, and if the
/// body then moves on, the inverse of that B serves until too much has changed. Where memory does not bear it, B is
/// stored or not even that.
GpuSolveOptions::Kind Scattering::prepare(GpuSolveOptions::Kind wanted, int columns) {
  using Kind = GpuSolveOptions::Kind;
  Kind kind = wanted;
  if (wanted == Kind::kAuto) {
    if (!factors_are_current_) {
      invert_for(columns);
    }
    const bool pays = (is_wide(columns) || !spec_.burton_miller) && inverse_.size() == 0;
    kind = has_current_factors() || pays ? Kind::kLu : Kind::kGmres;
  }
  const bool stays = boundary().is_stored() || has_current_factors();
  if (kind == Kind::kFft || (wanted == Kind::kAuto && kind == Kind::kGmres && !stays && grid_pays(columns))) {
    try {
      go_through_grid();
      return Kind::kFft;
    } catch (const GpuMemoryFailure&) {
      leave_grid();
      kind = Kind::kMatrixFree;
    }
  }
  leave_grid();
  const double missing = (boundary().is_stored() ? 0.0 : 1.0) + (factors_.size() > 0 ? 0.0 : 1.0);
  if (kind == Kind::kLu && !fits(missing * matrix_bytes())) {
    kind = Kind::kGmres;
  }
  const bool few = wanted == Kind::kAuto && columns <= kFewColumns && !boundary().is_stored();
  if (kind == Kind::kMatrixFree || (kind == Kind::kGmres && few) ||
      (!boundary().is_stored() && !fits(matrix_bytes()))) {
    boundary().forget();
    return Kind::kMatrixFree;
  }
  if (!boundary().is_stored()) {
    boundary().store();
  }
  return kind;
}

/// How many leading columns may be multiplied in TF32, given the shares by which their errors count: of a basis, the
/// weakest first, about a half. Of plain schemes, whose solutions magnify residuals, none.
int Scattering::rough_columns(const double* shares, int columns, double tolerance) const {
  int rough = 0;
  while (spec_.burton_miller && rough < columns && shares[rough] * kTf32Error <= tolerance) {
    ++rough;
  }
  return rough;
}

/// GMRES, by the factors of B or the inverse of an earlier one where there is such. With these it starts from zero: its
/// first step is then nearer than the pressures before, if the array moved, and saves their product.
void Scattering::solve_block(const Block& block, const GpuSolveOptions& options, const GpuProgress& progress,
                             GpuSolveReport& report) {
  const bool by_factors = report.kind == GpuSolveOptions::Kind::kLu;
  if (by_factors) {
    factorise();
  }
  const cublasOperation_t op = block.transposed ? CUBLAS_OP_T : CUBLAS_OP_N;
  const int m = spec_.faces;
  const BlockProduct apply = [&](const cuComplex* x, cuComplex* y, int columns, const double* shares) {
    boundary().apply(block.transposed, x, y, columns, rough_columns(shares, columns, options.tolerance));
  };
  const BlockPreconditioner precondition = [&](const cuComplex* v, cuComplex* z, int columns) {
    if (by_factors) {
      copy(v, z, std::size_t{1} * m * columns);
      lu_.solve(op, columns, z);
    } else {
      multiply(context_, op, CUBLAS_OP_N, m, columns, m, kOne, inverse_.data(), m, v, m, kZero, z, m,
               Arithmetic::kTf32);
    }
  };
  const bool has_inverse = by_factors || inverse_.size() > 0;
  const bool by_grid = report.kind == GpuSolveOptions::Kind::kFft;
  const double tolerance = by_grid ? kGridShare * options.tolerance : options.tolerance;
  const GmresLimits limits{tolerance, options.max_steps, options.restart, options.together};
  const GmresReport done =
      has_inverse || !spec_.burton_miller
          ? gmres_.solve(apply, m, block.columns, block.b, block.x, limits, block.warm && !has_inverse, progress,
                         has_inverse ? &precondition : nullptr)
          : solve_by_two_levels(block, apply, limits, report.kind, progress);
  report.steps = std::max(report.steps, done.steps);
  report.residual = std::max(report.residual, done.worst + (by_grid ? grid_->tolerance() : 0.0));
  report.converged = report.converged && report.residual <= options.tolerance;
  shares_.insert(shares_.end(), done.shares.begin(), done.shares.end());
}

/// How long a product takes; see kGridSeconds.
double Scattering::step_seconds(GpuSolveOptions::Kind kind, int columns) const {
  const double m = spec_.faces;
  return kind == GpuSolveOptions::Kind::kFft ? kGridSeconds * m * columns
                                             : m * m * std::max(kRowSeconds, kRowColumnSeconds * columns);
}

/// Whether there is one now. It is only for speed: where memory or its matrices do not bear it, nothing is made.
bool Scattering::make_two_level() {
  try {
    two_level_ = std::make_unique<TwoLevel>(faces_, boundary(), spec_.coupling);
    two_level_is_current_ = true;
  } catch (const GpuMemoryFailure&) {
    has_two_level_ = false;
  } catch (const std::domain_error&) {
    has_two_level_ = false;
  }
  return has_two_level_;
}

/// GMRES without an inverse. If the second half of its steps so far tells that those to come take longer than making a
/// two-level preconditioner, it goes on with that. One that takes too many steps is given up for this body.
GmresReport Scattering::solve_by_two_levels(const Block& block, const BlockProduct& apply, const GmresLimits& limits,
                                            GpuSolveOptions::Kind kind, const GpuProgress& progress) {
  const double step = step_seconds(kind, block.columns);
  const double set_up = kTwoLevelSeconds + kTwoLevelFaceSeconds * spec_.faces + kTwoLevelSteps * step;
  int steps = 0;
  bool warm = block.warm;
  const auto go_on = [&](const GmresLimits& within, const BlockPreconditioner* precondition) {
    GmresLimits rest = within;
    rest.max_steps = std::min(within.max_steps, limits.max_steps - steps);
    const auto told = [&, before = steps](int done, double residual) {
      if (progress) {
        progress(before + done, residual);
      }
    };
    GmresReport report =
        gmres_.solve(apply, spec_.faces, block.columns, block.b, block.x, rest, warm, told, precondition);
    warm = true;
    report.steps = steps += report.steps;
    return report;
  };
  if (!two_level_) {
    bool pays = false;
    std::vector<double> logs{0.0};  // of the residuals after each step
    GmresLimits trial = limits;
    trial.enough = [&](int done, double residual) {
      logs.push_back(std::log(residual));
      const int half = done / 2;
      const double a_step = std::max((logs[half] - logs[done]) / (done - half), kLeastGain);
      const double left = (logs[done] - std::log(limits.tolerance)) / a_step;
      return pays = has_two_level_ && done >= kTrialSteps && left * step > set_up;
    };
    const GmresReport report = go_on(trial, nullptr);
    if (!pays) {
      return report;
    }
    if (!make_two_level()) {
      return go_on(limits, nullptr);
    }
  }
  const BlockPreconditioner precondition = [&](const cuComplex* v, cuComplex* z, int columns) {
    two_level_->apply(block.transposed, v, columns, z);
  };
  GmresLimits weak = limits;
  weak.weak = true;
  weak.max_steps = kMostTwoLevelSteps;
  const int before = steps;
  const GmresReport report = go_on(weak, &precondition);
  if (steps - before > kManyTwoLevelSteps && !two_level_is_current_) {
    two_level_.reset();  // the next block makes another
  }
  if (report.converged || steps - before < kMostTwoLevelSteps) {
    return report;
  }
  has_two_level_ = has_two_level_ && !two_level_is_current_;
  two_level_.reset();
  return go_on(limits, nullptr);
}

/// In blocks of columns whose Krylov space has room; smaller ones where memory is short, then without a stored matrix.
GpuSolveReport Scattering::solve_columns(const Block& all, const GpuSolveOptions& options,
                                         const GpuProgress& progress) {
  using Kind = GpuSolveOptions::Kind;
  GpuSolveReport report;
  report.converged = true;
  shares_.clear();
  report.kind = prepare(options.kind, all.columns);
  const double column = 8.0 * spec_.faces * (std::min(kUsualSteps, options.restart) + 8);
  const double room = kShareOfFree * static_cast<double>(context_.allowed() - context_.taken());
  int width = std::max(1, static_cast<int>(std::min<double>(all.columns, room / column)));
  for (int first = 0; first < all.columns;) {
    Block block = all;
    block.columns = std::min(width, all.columns - first);
    block.b += std::size_t{1} * first * spec_.faces;
    block.x += std::size_t{1} * first * spec_.faces;
    try {
      solve_block(block, options, progress, report);
    } catch (const GpuMemoryFailure&) {
      gmres_.release();
      if (two_level_) {
        two_level_.reset();
        has_two_level_ = false;
      } else if (inverse_.size() > 0) {
        inverse_.reset();
      } else if (report.kind == Kind::kLu && !has_current_factors()) {
        drop_factors();
        report.kind = Kind::kGmres;
      } else if (width > 1) {
        width = (width + 1) / 2;
      } else if (report.kind != Kind::kMatrixFree) {
        boundary().forget();
        leave_grid();
        drop_factors();
        report.kind = Kind::kMatrixFree;
        width = all.columns;
      } else {
        throw;
      }
      continue;
    }
    first += block.columns;
  }
  if (report.kind == Kind::kGmres && report.steps > kMostSteps) {
    inverse_.reset();  // the next block makes another
  }
  return report;
}

/// p_ = x_, then twice p_ += e - B_c p_, e of the drives: d = e - B_c x, p = x + 2 d - B_c d, where what multiplies d
/// need not have all digits, which is small beside p, nor what multiplies x in the columns that count for little.
void Scattering::polish(const cuComplex* drives, int columns, double tolerance) {
  const std::size_t size = std::size_t{1} * spec_.faces * columns;
  p_.resize(size);
  polished_.resize(size);
  const int channels = sources().size();
  multiply(context_, CUBLAS_OP_N, CUBLAS_OP_N, spec_.faces, columns, channels, kOne, g_.data(), spec_.faces, drives,
           channels, kZero, right_.data(), spec_.faces, Arithmetic::kSingle);
  plain().apply(false, x_.data(), p_.data(), columns, rough_columns(shares_.data(), columns, tolerance / 2));
  add(context_, kMinusOne, p_.data(), right_.data(), size);
  plain().apply(false, right_.data(), polished_.data(), columns, columns);
  copy(x_.data(), p_.data(), size);
  add(context_, {2.0F, 0.0F}, right_.data(), p_.data(), size);
  add(context_, kMinusOne, polished_.data(), p_.data(), size);
}

GpuSolveReport Scattering::pressures_of(const cuComplex* drives, int columns, bool warm, const GpuSolveOptions& options,
                                        const GpuProgress& progress) {
  make_field();
  const std::size_t size = std::size_t{1} * spec_.faces * columns;
  const int channels = sources().size();
  warm = warm && columns == columns_;
  columns_ = 0;
  right_.resize(size);
  x_.resize(size);
  const cuComplex* b = right_sides();
  multiply(context_, CUBLAS_OP_N, CUBLAS_OP_N, spec_.faces, columns, channels, kOne, b, spec_.faces, drives, channels,
           kZero, right_.data(), spec_.faces, Arithmetic::kSingle);
  const GpuSolveReport report = solve_columns({false, columns, right_.data(), x_.data(), warm}, options, progress);
  if (spec_.polished) {
    polish(drives, columns, options.tolerance);
  }
  columns_ = columns;
  return report;
}

GpuSolveReport Scattering::solve(const GpuComplex* drives, int columns, bool warm, const GpuSolveOptions& options,
                                 const GpuProgress& progress) {
  context_.use();
  if (drives != nullptr) {
    host_.upload(reinterpret_cast<const cuDoubleComplex*>(drives), std::size_t{1} * sources().size() * columns);
    drives_.resize(host_.size());
    convert(context_, host_.data(), drives_.data(), host_.size());
  }
  const GpuSolveReport report = pressures_of(drives_.data(), columns, warm, options, progress);
  if (options.together && options.kind == GpuSolveOptions::Kind::kAuto) {
    invert_for(columns);  // before the first frame that has to be fast
  }
  return report;
}

std::unique_ptr<GpuBody> Context::body(const GpuBodySpec& spec) {
  use();
  return std::make_unique<Scattering>(*this, spec);
}

}  // namespace touchfield::cuda
