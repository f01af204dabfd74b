#pragma once

#include <complex>
#include <functional>
#include <vector>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

/// y = A x for a block of columns, both n x columns on the card, column by column without gaps, not overlapping;
/// enqueued on the context's stream.
///
/// shares   how large each column of A x counts, of ||b||: in what is solved for, its error is multiplied by that
using BlockProduct = std::function<void(const cuComplex* x, cuComplex* y, int columns, const double* shares)>;
/// The same of a preconditioner, whose error does not count.
using BlockPreconditioner = std::function<void(const cuComplex* v, cuComplex* z, int columns)>;

struct GmresLimits {
  double tolerance = 1e-5;  ///< relative residual ||b - A x|| / ||b|| a column is to reach, > 0
  int max_steps = 300;      ///< a column, >= 0
  int restart = 60;         ///< steps after which a column's space is built anew, >= 1; at most 512 are used
  bool together = false;    ///< ||b|| of a column counts as the root mean square of all where it is less
  bool weak = false;        ///< `precondition` is not near A^-1: it takes some steps
  /// Asked after each step with the number of steps done and the worst estimated residual; true ends the solution there.
  std::function<bool(int, double)> enough = {};
};

struct GmresReport {
  int steps = 0;                  ///< of the block
  int products = 0;               ///< block products in all
  double worst = 0.0;             ///< of residuals
  std::vector<double> residuals;  ///< of each column: ||b - A x|| / ||b||, by products of what x is made of
  std::vector<double> shares;     ///< that each column's b has of the norm that counts: 1, unless `together`
  bool converged = false;         ///< every column has reached the tolerance
};

/// Solves A X = B in single precision by restarted GMRES, all columns at once, as touchfield::gmres does
/// (solvers/linear/gmres.h): a space of its own for each column, one block product a step, columns that have reached
/// the tolerance leave the block; after each cycle residuals by a product of what it has added to x; given up are
/// columns that have spent their steps or that a cycle has lessened by under 0.1 %. From a given x it begins with r = b
/// - A x, and a column in tolerance takes no step. A step without its product is a few kernels for all columns and one
/// wait for what they have found, by which the host solves the least-squares problems. What it takes of the card grows
/// by a block a step, is kept for the next solve, and is given back by release().
///
/// apply      A X in single precision, or TF32 where a column's share bears it: a step's is the residual before it, as
///            large an error of A x as the tolerance is smaller (Simoncini, Szyld, SIAM J. Sci. Comput. 25 (2003) 454);
///            that of what a cycle adds to x is the residual before the cycle, which a cycle of one step has multiplied
///            already: with a `precondition` that is not weak the first one is such a cycle. Later steps of those that follow, which are
///            few, bear any error (0), as cycles end before it shows.
/// b, x       n x S on the card, column by column without gaps, not overlapping; x is read only if it is a start
/// precondition  if given, a matrix P near A^-1, P V: the space is that of A P, and x is taken from P V as it was made,
///               so that P
///            need not be the same from step to step nor exact (flexible GMRES: Saad, SIAM J. Sci. Comput. 14 (1993)
///            461)
/// report     called after each step with the number of steps done and the worst estimated residual
/// accuracy   the true residual of a converged column is at most the tolerance, but for errors of apply. Below about
///            1e-7 ||A|| ||x|| / ||b|| rounding stops it. Repeats to the bit if apply does.
/// memory     (restart + 2) n S complex numbers of single precision at most, twice that with `precondition`
/// throws     std::domain_error if b, the start or a product holds a value that is not finite; x is undefined then,
///            std::invalid_argument for limits out of range, GpuMemoryFailure; what was taken till then is kept too
class BlockGmres {
 public:
  explicit BlockGmres(Context& context) : context_(&context) {}

  GmresReport solve(const BlockProduct& apply, int n, int columns, const cuComplex* b, cuComplex* x,
                    const GmresLimits& limits, bool x_is_start, const std::function<void(int, double)>& report = {},
                    const BlockPreconditioner* precondition = nullptr);

  void release() { *this = BlockGmres(*context_); }

  /// A column of a sum of columns: a vector times a factor.
  struct Term {
    const cuComplex* vector;
    cuComplex factor;
  };
  /// Where a sum goes, and what it is multiplied by.
  struct Target {
    cuComplex* column;
    double scale;
  };

 private:
  struct Problem;
  struct Column;

  std::vector<Column> start(const Problem& problem, int columns, bool x_is_start);
  std::size_t run_cycle(const Problem& problem, std::vector<Column>& running);
  void update(const Problem& problem, std::vector<Column>& running, std::size_t most);
  void combine(const std::vector<Term>& terms, std::size_t count, const std::vector<Target>& targets);
  unsigned parts(std::size_t columns) const;
  void make_orthogonal(std::size_t columns, int count, Term* vectors);
  void multiply(const Problem& problem, const cuComplex* x, const std::vector<double>& shares);
  const std::complex<double>* wait(std::size_t count);
  void check_finite(double value) const;

  Context* context_;
  std::vector<Array<cuComplex>> bases_;       // the vectors of each step
  std::vector<Array<cuComplex>> directions_;  // what it multiplies, where these are preconditioned
  Array<cuComplex> product_{*context_};       // of the last block, or what is left of it
  Array<cuComplex> candidate_{*context_};
  Array<Term> terms_{*context_};
  Array<Target> targets_{*context_};
  Array<cuDoubleComplex> found_{*context_};     // by kernels, for the host
  Array<double> squares_{*context_};            // of parts of columns
  Array<cuDoubleComplex> products_{*context_};  // of parts of columns and vectors
  std::size_t rows_ = 0;                        // of the columns that are solved for
  bool enough_ = false;
  GmresReport result_;
};

}  // namespace touchfield::cuda
