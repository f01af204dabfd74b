#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>

#include "sim/gpu/cuda/block_gmres.cuh"

namespace touchfield::cuda {

namespace {

using Complex = std::complex<double>;

constexpr int kMostSteps = 512;  // of a cycle: more hardly fit a card

// A vector left with this share of its norm after orthogonalisation is rounding, not a new direction.
constexpr double kRounding = 16.0 * FLT_EPSILON;

// A cycle that leaves more than this share of the residual has stagnated: the next one would start from the same.
constexpr double kStagnation = 0.999;

// A cycle with products in TF32 leaves at least this share of a residual: the next one mends it.
constexpr double kMended = 1e-3;

constexpr cuComplex kOne = {1.0F, 0.0F};

cuComplex single(Complex value) { return {static_cast<float>(value.real()), static_cast<float>(value.imag())}; }

}  // namespace

struct BlockGmres::Problem {
  const BlockProduct& apply;
  const BlockPreconditioner* precondition;
  const cuComplex* b;
  cuComplex* x;
  GmresLimits limits;
  const std::function<void(int, double)>& report;
  std::size_t most;  // dimension of a space

  /// Whether a step is nearly the solution.
  bool by_inverse() const { return precondition != nullptr && !limits.weak; }
};

/// A column that is still solved for, its Krylov space and the least-squares problem in it, triangular by Givens
/// rotations.
struct BlockGmres::Column {
  std::size_t index;      // of the caller's b and x
  double norm;            // ||b||, > 0
  double residual;        // least ||b - A x|| / ||b|| so far
  int steps;              // in all cycles
  double before;          // norm of b - A x at the beginning of the cycle
  double estimate;        // relative residual of the minimiser
  const cuComplex* next;  // what will be the next vector of the basis, and its norm
  double length;
  std::vector<Complex> reduced;                       // right-hand side
  std::vector<Complex> triangle;                      // columns of 1, 2, 3 ... numbers
  std::vector<std::pair<double, Complex>> rotations;  // cosine and sine; as many as the space has dimensions
  std::vector<Term> basis;
  std::vector<Term> directions;  // what was multiplied: these, or these preconditioned
  bool exhausted;                // the space holds its image

  /// At the beginning of a cycle, from a residual of the given norm, > 0.
  static Column begun(std::size_t index, double norm, double residual, int steps, const cuComplex* next,
                      double length) {
    return {index, norm, residual, steps, length, length / norm, next, length, {Complex(length)},
            {},    {},   {},       {},    false};
  }

  /// Takes in what orthogonalise() has found in a product, and what it has left of it.
  void extend(const Complex* found, const cuComplex* left) {
    const std::size_t k = rotations.size();
    const double size = found[k + 1].imag();
    ++steps;
    next = left;
    length = found[k + 1].real();
    exhausted = !(length > kRounding * size);
    Complex last = found[0];
    for (std::size_t i = 0; i < k; ++i) {
      const auto& [c, s] = rotations[i];
      triangle.push_back(c * last + s * found[i + 1]);
      last = c * found[i + 1] - std::conj(s) * last;
    }
    const double above = std::abs(last);
    if (exhausted && above <= kRounding * size) {
      return;  // A is singular on the space: the new direction cannot lessen the residual
    }
    const double below = exhausted ? 0.0 : length;
    const double both = std::hypot(above, below);
    const Complex phase = above > 0.0 ? last / above : 1.0;
    const Complex sine = phase * (below / both);
    rotations.emplace_back(above / both, sine);
    triangle.push_back(phase * both);
    reduced.push_back(-std::conj(sine) * reduced[k]);
    reduced[k] *= above / both;
    estimate = std::abs(reduced[k + 1]) / norm;
  }

  /// After one step, of the residual the part along its vector, and what it has of what is left of the product.
  std::pair<Complex, Complex> only_residual() const {
    const Complex y = rotations.empty() ? 0.0 : reduced[0] / triangle[0];
    return {rotations.empty() ? before : before - y * triangle[0] * rotations[0].first, -y};
  }

  /// What the best x in the space has of each direction.
  std::vector<Term> minimiser() const {
    std::vector<Term> terms(directions.begin(), directions.begin() + static_cast<std::ptrdiff_t>(rotations.size()));
    std::vector<Complex> y = reduced;
    for (std::size_t j = terms.size(); j-- > 0;) {
      const Complex* column = triangle.data() + j * (j + 1) / 2;
      y[j] /= column[j];
      for (std::size_t i = 0; i < j; ++i) {
        y[i] -= column[i] * y[j];
      }
      terms[j].factor = single(y[j]);
    }
    return terms;
  }
};

GmresReport BlockGmres::solve(const BlockProduct& apply, int n, int columns, const cuComplex* b, cuComplex* x,
                              const GmresLimits& limits, bool x_is_start,
                              const std::function<void(int, double)>& report, const BlockPreconditioner* precondition) {
  if (!(limits.tolerance > 0.0) || limits.max_steps < 0 || limits.restart < 1) {
    throw std::invalid_argument("gmres: tolerance must be > 0, max_steps >= 0 and restart >= 1");
  }
  result_ = {};
  result_.residuals.assign(static_cast<std::size_t>(columns), 0.0);
  if (n > 0 && columns > 0) {
    rows_ = static_cast<std::size_t>(n);
    const auto most = static_cast<std::size_t>(std::min({limits.restart, limits.max_steps, n, kMostSteps}));
    const Problem problem{apply, precondition, b, x, limits, report, most};
    std::vector<Column> running = start(problem, columns, x_is_start);
    enough_ = false;
    for (bool in_cycle = !x_is_start; !running.empty() && !enough_; in_cycle = true) {
      update(problem, running, in_cycle ? run_cycle(problem, running) : 0);
    }
    result_.worst = *std::max_element(result_.residuals.begin(), result_.residuals.end());
  }
  result_.converged = result_.worst <= limits.tolerance;
  return std::move(result_);
}

/// The columns that are to be solved for; room for what all steps need; x zero, or only where b is if it is a start.
std::vector<BlockGmres::Column> BlockGmres::start(const Problem& problem, int columns, bool x_is_start) {
  const auto count = static_cast<std::size_t>(columns);
  while (bases_.size() < problem.most) {
    bases_.emplace_back(*context_);
    directions_.emplace_back(*context_);
  }
  product_.resize(rows_ * count);
  candidate_.resize(rows_ * count);
  terms_.resize(count * (problem.most + 1));
  found_.resize(count * (problem.most + 1));
  if (!x_is_start) {
    check(cudaMemsetAsync(problem.x, 0, rows_ * count * sizeof(cuComplex), context_->stream()), "set to zero");
  }
  std::vector<Term> b;
  std::vector<Target> residuals;
  for (std::size_t s = 0; s < count; ++s) {
    b.push_back({problem.b + rows_ * s, kOne});
    residuals.push_back({product_.data() + rows_ * s, 1.0});
  }
  combine(b, 1, residuals);
  const Complex* norms = wait(count);
  double squares = 0.0;
  for (std::size_t s = 0; s < count; ++s) {
    squares += std::norm(norms[s]);
  }
  const double least = problem.limits.together ? std::sqrt(squares / static_cast<double>(count)) : 0.0;
  result_.shares.resize(count);
  const bool begins = x_is_start || (problem.limits.max_steps > 0 && problem.limits.tolerance < 1.0);
  std::vector<Column> running;
  for (std::size_t s = 0; s < count; ++s) {
    const double norm = norms[s].real();
    if (!std::isfinite(norm)) {
      throw std::domain_error("gmres: right-hand side " + std::to_string(s) + " holds a value that is not finite");
    }
    const double whole = std::max(norm, least);
    result_.residuals[s] = result_.shares[s] = norm > 0.0 ? norm / whole : 0.0;
    if (norm > 0.0 && begins) {
      const double residual = x_is_start ? std::numeric_limits<double>::infinity() : result_.residuals[s];
      running.push_back(Column::begun(s, whole, residual, 0, residuals[s].column, norm));
    } else if (x_is_start) {
      check(cudaMemsetAsync(problem.x + rows_ * s, 0, rows_ * sizeof(cuComplex), context_->stream()), "set to zero");
    }
  }
  return running;
}

/// Enlarges the spaces, all of them a step at once, until each is done for this cycle; how many steps that took.
std::size_t BlockGmres::run_cycle(const Problem& problem, std::vector<Column>& running) {
  std::vector<Column*> live;
  for (Column& column : running) {
    live.push_back(&column);
  }
  std::size_t k = 0;
  for (; !live.empty(); ++k) {
    Array<cuComplex>& basis = bases_[k];
    Array<cuComplex>& direction = problem.precondition != nullptr ? directions_[k] : basis;
    basis.resize(rows_ * live.size());
    direction.resize(basis.size());
    std::vector<double> shares;
    std::vector<Term> terms(live.size());  // what is next in each column, then the bases
    std::vector<Target> places;
    for (std::size_t i = 0; i < live.size(); ++i) {
      Column& column = *live[i];
      shares.push_back(k == 0 || !problem.by_inverse() ? column.estimate : 0.0);
      terms[i] = {column.next, kOne};
      places.push_back({basis.data() + rows_ * i, 1.0 / column.length});
      column.basis.push_back({places[i].column, {}});
      column.directions.push_back({direction.data() + rows_ * i, {}});
      terms.insert(terms.end(), column.basis.begin(), column.basis.end());
    }
    combine(terms, 1, places);
    if (problem.precondition != nullptr) {
      (*problem.precondition)(basis.data(), direction.data(), static_cast<int>(live.size()));
    }
    multiply(problem, direction.data(), shares);
    make_orthogonal(live.size(), static_cast<int>(k + 1), terms_.data() + live.size());
    const Complex* found = wait(live.size() * (k + 2));
    ++result_.steps;
    for (std::size_t i = 0; i < live.size(); ++i, found += k + 2) {
      check_finite(found[k + 1].imag());
      live[i]->extend(found, product_.data() + rows_ * i);
    }
    const auto less = [](const Column& a, const Column& b) { return a.estimate < b.estimate; };
    const double worst = std::max_element(running.begin(), running.end(), less)->estimate;
    if (problem.report) {
      problem.report(result_.steps, worst);
    }
    enough_ = problem.limits.enough && problem.limits.enough(result_.steps, worst);
    const double mended = problem.by_inverse() ? kMended : 0.0;
    const auto done = [&](const Column* column) {
      const double target = std::max(problem.limits.tolerance, mended * column->before / column->norm);
      return column->estimate <= target || column->exhausted || column->rotations.size() == problem.most ||
             column->steps >= problem.limits.max_steps || (problem.by_inverse() && column->steps == 1) || enough_;
    };
    live.erase(std::remove_if(live.begin(), live.end(), done), live.end());
  }
  return k;
}

/// Moves to the minimisers in spaces of at most so many dimensions, forms the residuals that this leaves, and begins a
/// new cycle for those that go on. At first, without a space, the residuals of a start.
void BlockGmres::update(const Problem& problem, std::vector<Column>& running, std::size_t most) {
  std::vector<Term> added, residuals;
  std::vector<Target> candidates, products;
  std::vector<double> shares;
  const bool begins = most == 0;
  const std::size_t width = std::max<std::size_t>(most, 1);
  for (std::size_t i = 0; i < running.size(); ++i) {
    const Column& column = running[i];
    cuComplex* const x = problem.x + rows_ * column.index;
    candidates.push_back({candidate_.data() + rows_ * i, 1.0});
    products.push_back({product_.data() + rows_ * i, 1.0});
    const std::vector<Term> terms = begins ? std::vector<Term>{{x, kOne}} : column.minimiser();
    added.insert(added.end(), terms.begin(), terms.end());
    added.resize((i + 1) * width, {x, {}});  // where the space has fewer dimensions
    const auto [part, rest] =
        most == 1 ? column.only_residual() : std::pair<Complex, Complex>(begins ? 1.0 : column.before, -1.0);
    residuals.push_back({begins ? problem.b + rows_ * column.index : column.basis[0].vector, single(part)});
    residuals.push_back({products[i].column, single(rest)});
    shares.push_back(begins ? 1.0 : column.before / column.norm);
  }
  combine(added, width, candidates);
  if (most != 1) {
    multiply(problem, candidate_.data(), shares);
  }
  combine(residuals, 2, products);
  const Complex* norms = wait(running.size());
  std::vector<Column> left;
  std::vector<Term> better;
  std::vector<Target> improved;
  for (std::size_t i = 0; i < running.size(); ++i) {
    Column& column = running[i];
    cuComplex* const x = problem.x + rows_ * column.index;
    const double norm = norms[i].real();
    check_finite(norm);
    const double reached = norm / column.norm;
    const bool stagnated = column.steps > 1 && reached > kStagnation * column.residual;
    if (reached < column.residual) {
      column.residual = reached;
      better.push_back({x, kOne});
      better.push_back({candidates[i].column, kOne});
      improved.push_back({x, 1.0});
    }
    result_.residuals[column.index] = column.residual;
    if (!stagnated && column.residual > problem.limits.tolerance && column.steps < problem.limits.max_steps) {
      left.push_back(Column::begun(column.index, column.norm, column.residual, column.steps, products[i].column, norm));
    }
  }
  if (!begins && !improved.empty()) {
    combine(better, 2, improved);
  }
  running = std::move(left);
}

/// Waits for the card; the first numbers that were found, until something else comes to the host.
const std::complex<double>* BlockGmres::wait(std::size_t count) {
  auto* landed = static_cast<cuDoubleComplex*>(context_->staging(found_.size() * sizeof(cuDoubleComplex)));
  found_.download(landed, count);
  return reinterpret_cast<const Complex*>(landed);
}

void BlockGmres::multiply(const Problem& problem, const cuComplex* x, const std::vector<double>& shares) {
  problem.apply(x, product_.data(), static_cast<int>(shares.size()), shares.data());
  ++result_.products;
}

void BlockGmres::check_finite(double value) const {
  if (!std::isfinite(value)) {
    throw std::domain_error("gmres: product " + std::to_string(result_.products) + " holds a value that is not finite");
  }
}

}  // namespace touchfield::cuda
