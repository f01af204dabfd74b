#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "solvers/linear/linear_operator.h"

namespace touchfield {

struct GmresOptions {
  double tolerance = 1e-6;  ///< relative residual ||b - A x|| / ||b|| a column is to reach, > 0
  int max_steps = 300;      ///< a column, >= 0
  int restart = 60;         ///< steps after which a column's space is built again, >= 1
};

struct GmresResult {
  Eigen::MatrixXcd x;             ///< n x S
  std::vector<int> steps;         ///< of each column: products that enlarged its space
  std::vector<double> residuals;  ///< of each column: ||b - A x|| / ||b|| with a product of the returned x
  int products = 0;               ///< block products in all
  int columns = 0;                ///< columns multiplied in all
  bool converged = false;         ///< every column has reached the tolerance
};

/// Solves A X = B by restarted GMRES, all columns at once: x = 0 at first, then in every cycle
///
///   x <- x + V y,   y = argmin || r - A V y ||,   span V = { r, A r, .., A^(k-1) r },   r = b - A x.
///
/// Each column has a space of its own. One block product serves a step of all columns. A column leaves the block when
/// its estimated residual is in tolerance or its cycle is over. The true residuals are formed at the end of each cycle,
/// with one block product more. A column with a true residual above the tolerance continues. It is given up, with
/// converged = false, when it has spent its steps or the cycle has lessened its true residual by under 0.1 %. The
/// latter is due to a singular matrix, a stagnating restart, or a tolerance below the rounding of the product. The
/// better iterate of a column that is given up is returned. A zero column is solved by zero in no step.
///
/// With a right preconditioner M it solves (A M) y = b and returns x = M y. Residuals are those of A x = b.
///
/// apply     A X; an n x n matrix, which need not be stored
/// b         n x S, finite
/// preconditioner   M X, the same linear map in every call up to rounding; none: M = 1
/// report    called after each block step with the number of block steps done and the worst estimated residual
/// accuracy  the true residual of a converged column is at most the tolerance. Sums over rows have one order, whatever
///           the number of threads: results depend on it only as far as apply does.
/// memory    restart x n x S complex numbers
/// throws    std::domain_error if b or a product holds a value that is not finite,
///           std::invalid_argument for options out of range or a product of another shape
/// source    Saad, Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856; orthogonalised by classical Gram-Schmidt twice:
///           Giraud, Langou, Rozloznik, van den Eshof, Numer. Math. 101 (2005) 87
GmresResult gmres(const Product& apply, const Eigen::MatrixXcd& b, const GmresOptions& options,
                  const std::function<void(int step, double worst_residual)>& report = {},
                  const Product& preconditioner = {});

struct RefinementOptions {
  double tolerance = 1e-10;  ///< relative residual ||b - A x|| / ||b|| a column is to reach, > 0
  int max_rounds = 10;       ///< corrections at most, >= 0
};

struct RefinementResult {
  Eigen::MatrixXcd x;             ///< n x S
  std::vector<double> residuals;  ///< of each column: ||b - A x|| / ||b|| by the exact product
  int rounds = 0;                 ///< corrections made after the first solution
  bool converged = false;         ///< every column has reached the tolerance
};

/// Iterative refinement: x = C b, then x <- x + C (b - A x) for the columns above the tolerance, C being close to A^-1.
/// It stops early after max_rounds or when a round does not halve the worst residual. `converged` is false if a column
/// is then still above the tolerance. Each column has the best of its iterates, x = 0 among them.
///
/// exact                 A X in the precision the residuals are to have
/// approximate_inverse   C X; gets columns of unit norm, so that in single precision no small residual underflows
/// b                     n x S, finite
/// throws                std::domain_error if b, a correction or a product holds a value that is not finite,
///                       std::invalid_argument for options out of range or a product of another shape
/// source                Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., ch. 12
RefinementResult refine(const Product& exact, const Product& approximate_inverse, const Eigen::MatrixXcd& b,
                        const RefinementOptions& options);

}  // namespace touchfield
