#pragma once

#include <complex>
#include <cstddef>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/bem/grid_loops.h"
#include "solvers/phase/phase_device.h"

namespace touchfield {

/// What libtouchfield_gpu offers: work of a graphics card behind plain C++, so that the program starts where CUDA is
/// not. Matrices are column by column. An object that a Gpu made must not outlive it; neither is for two threads at
/// once.

/// A call to the card failed: it is lost, refused, or a kernel broke.
class GpuFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The card, or the part of it that may be used, has no room for what was asked.
class GpuMemoryFailure : public GpuFailure {
 public:
  using GpuFailure::GpuFailure;
};

struct GpuInfo {
  int index = 0;
  std::string name;
  int major = 0, minor = 0;  // compute capability
  std::size_t memory = 0;    // [bytes]
  std::string driver;        // newest CUDA that the driver carries out, e.g. "13.0"
  std::string toolkit;       // that the library was made with
};

using GpuComplex = std::complex<double>;

/// A grid through which a body's sums may go (sim/bem/grid_spec.h), as the processor makes it for where the body is.
struct GpuGrid {
  double tolerance = 0;                     // of products
  double step = 0, reach = 0;               // [m]
  double origin[3] = {};                    // the lowest place along each axis [m]
  int points[3] = {}, period[3] = {};       // of the grid, and what is transformed
  int width = 0, lanes = 0;                 // of the window
  std::vector<float> window;                // its polynomials (GridWindow)
  LocalKernel<float> local{};               // of D + i gamma W
  std::vector<std::complex<float>> symbol;  // on the octant (grid_symbol)
};

/// A closed mesh and what is asked of it: a scheme of ScatteringSystem, but kChief.
struct GpuBodySpec {
  const double* vertices = nullptr;  // 3 x vertex_count [m]
  int vertex_count = 0;
  const int* triangles = nullptr;  // 3 x faces
  int faces = 0;                   // M
  double k = 0;                    // [1/m]
  double alpha = 0;                // absorption [1/m]
  double coupling = 1;             // eta = coupling i / k of Burton-Miller
  bool burton_miller = false;      // else the plain equation
  bool corrected = false;          // the plain diagonal is that of the static Gauss identity, else 1/2
  bool polished = false;           // two fixed-point steps of the plain equation afterwards
  double split_ratio = 0, seven_below = 0, three_below = 0;  // FaceRule
  std::function<GpuGrid()> grid;  // none: no grid suits. Called when one is needed, again after the body moved
};

/// An array, as TransducerArray has it.
struct GpuSources {
  bool plane_wave = false;
  int count = 0;                      // N
  const double* positions = nullptr;  // 3 x N [m]
  const double* axes = nullptr;       // 3 x N
  const double* amplitudes = nullptr;
  const GpuComplex* response = nullptr;  // N; null: 1
  const double* spline = nullptr;        // directivity, intervals x 4; null: piston_ka, 0: 1 everywhere
  int intervals = 0;
  double interval = 0;  // [rad]
  double piston_ka = 0;
};

struct GpuSolveOptions {
  enum class Kind { kAuto, kLu, kGmres, kMatrixFree, kFft };
  // kAuto: GMRES where it takes few steps, else LU; by a grid where that is given and cheaper, else stored where the
  // matrix fits
  Kind kind = Kind::kAuto;
  double tolerance = 1e-4;  // relative residual of every column, by products in single precision
  int max_steps = 400;
  int restart = 100;
  bool together = false;  // columns are a basis: residuals relative to the root mean square of all b where b is less
};

struct GpuSolveReport {
  GpuSolveOptions::Kind kind = GpuSolveOptions::Kind::kAuto;  // what was done
  int steps = 0;                                              // most GMRES steps of a column; LU takes one or two
  double residual = 0;
  bool converged = false;
};

/// step, worst residual of the columns so far
using GpuProgress = std::function<void(int, double)>;

/// Scattering by a body on the card. Kept there between calls: geometry, near integrals, the matrix where it is stored,
/// the field of every channel, and the last block of pressures, P = M x S [Pa].
///
/// accuracy   with tolerance t, t + 1e-5 of the largest pressure; 2e-5 while k times the body's length is below 150
/// throws     std::domain_error on values that are not finite and on a singular matrix
class GpuBody {
 public:
  GpuBody() = default;
  GpuBody(const GpuBody&) = delete;
  GpuBody& operator=(const GpuBody&) = delete;
  virtual ~GpuBody() = default;

  /// The same triangles with their vertices elsewhere. P stays: the next solve with as many columns starts from it.
  virtual void move(const double* vertices) = 0;
  /// In the frame of the vertices.
  virtual void set_sources(const GpuSources& sources) = 0;

  /// Makes P of drives N x S; null: those of the call before.
  ///
  /// warm   start from P as it is, if that has S columns
  virtual GpuSolveReport solve(const GpuComplex* drives, int columns, bool warm, const GpuSolveOptions& options,
                               const GpuProgress& progress) = 0;
  /// Makes P of drives V, N x r with orthonormal columns, that span what all channels do to the body but for the share
  /// `tolerance` of b, by norm.
  struct Span {
    int rank = 0;
    double left_out = 0;
    GpuSolveReport report;
  };
  virtual Span span(double tolerance, const GpuSolveOptions& options, const GpuProgress& progress) = 0;
  /// P, M x S.
  virtual void pressures(GpuComplex* all) = 0;
  /// With H = P V^H, V the drives of P, rows of H, count x N.
  virtual void rows(const int* faces, int count, GpuComplex* rows) = 0;
  /// The few rows R, with R^H R = H^H diag(weights) H but for eigenvalues of at most tolerance^2 of the largest. They
  /// are those of reduced_skin_problem (sim/field/skin_problems.h). reduce() says how many they are and what they
  /// leave out. reduced() gives the rows, rank x N. With tolerance 0, R is S rows by a Cholesky factor: in a frame
  /// eigenvectors take longer than they save. Where columns of P depend on each other, it has the rows that do not.
  struct Reduction {
    int rank = 0;
    double left_out = 0;
  };
  virtual Reduction reduce(const double* weights, double tolerance) = 0;
  virtual void reduced(GpuComplex* rows) = 0;

  /// Q of IncidentProblem (solvers/phase/incident_problem.h) in single precision, C = diag(sqrt w) [B_T diag(p'), -b]:
  /// B_T the columns of B of `count` faces or, not scattered, of the identity; p' their amplitudes, w one weight per
  /// face.
  ///
  /// beyond   added to Q, as large; or null
  virtual std::unique_ptr<GramDevice> incident_gram(const int* faces, int count, const double* amplitudes,
                                                    const double* weights, const GpuComplex* beyond,
                                                    bool scattered) = 0;

  /// Rows of H of the given faces by transposed solves, count x N [Pa]. P is lost.
  virtual GpuSolveReport transfer_rows(const int* faces, int count, GpuComplex* rows, const GpuSolveOptions& options,
                                       const GpuProgress& progress) = 0;
};

/// Points off the skin and where their field goes.
struct GpuField {
  const double* points = nullptr;       // 3 x J [m], none on a transducer
  int count = 0;                        // J
  const GpuComplex* surface = nullptr;  // M x S [Pa]: pressures on the faces
  const GpuComplex* drives = nullptr;   // N x S
  int columns = 0;                      // S > 0
  double far_distance = 0;              // in square roots of a face's area: faces nearer to a point are left out there
  GpuComplex* pressure = nullptr;       // J x S [Pa]: incident, and the double layer of the faces, one point each
  double* winding = nullptr;            // J: of the same faces, -1 where they are all of a body around the point
  int* near = nullptr;                  // J: how many are left out
};

/// A card, opened: its stream, its libraries' handles and the memory that may be taken. What it makes for the phase
/// methods must not outlive it either.
class Gpu : public PhaseDevice {
 public:
  virtual const GpuInfo& info() const = 0;
  /// Memory that this program has taken now, and the most it has taken [bytes].
  virtual std::size_t taken() const = 0;
  virtual std::size_t most_taken() const = 0;
  /// What it may take in all: the cap, or what was free when it was opened [bytes].
  virtual std::size_t allowed() const = 0;

  virtual std::unique_ptr<GpuBody> body(const GpuBodySpec& spec) = 0;
  /// The field at points by the sums over a surface's faces. `body` gives the mesh and the wavenumber. The points are
  /// taken in parts that fit into memory.
  ///
  /// accuracy   3e-7 of each face's part, which add up like errors at random; which faces are near as the processor has
  ///            it, to the last one
  virtual void field(const GpuBodySpec& body, const GpuSources& sources, const GpuField& field) = 0;
};

struct GpuLimits {
  std::size_t memory = 0;  // a cap [bytes]; 0: what is free
  int fail_after = -1;     // the call of this number fails, for tests; < 0: none
};

}  // namespace touchfield
