#pragma once

#include <string>
#include <vector>

/// How the equations of the boundary elements are set up and solved.

namespace touchfield {

/// How the boundary integral equation is discretised. All schemes keep one pressure a face and collocate at centroids.
enum class Scheme {
  kPaper,                 // one point per face, diagonal 1/2
  kPaperCorrected,        // the same with the diagonal from the static Gauss identity
  kChief,                 // paper_corrected and points inside the body where the total field vanishes
  kBurtonMiller,          // pressure and normal derivative combined, integrals done properly
  kBurtonMillerPolished,  // burton_miller, then two fixed-point steps of paper_corrected
};

/// What a scheme is made of: a row of the table in scheme.cpp, from which everything else follows.
struct SchemeTraits {
  const char* name;      // as scenes and results spell it
  bool corrected;        // the plain diagonal is that of the static Gauss identity, else 1/2
  bool burton_miller;    // Burton and Miller's equation is solved, else the plain one
  bool interior_points;  // rows of CHIEF
  bool polished;         // fixed-point steps of the plain equation afterwards
};

/// Every scheme, the cheapest first.
const std::vector<Scheme>& all_schemes();

const SchemeTraits& traits(Scheme scheme);

/// The scheme as scenes and results spell it.
std::string to_string(Scheme scheme);

/// How finely a face is integrated, by its distance from the point in units of the square root of its area.
struct FaceRule {
  double split_ratio = 1.4;  // a piece nearer than this times its own size is split in four; pieces have 7 points
  double seven_below = 3.0;  // whole faces: 7 points below this distance,
  double three_below = 8.0;  // 3 points below this one, one point beyond
};

struct SystemOptions {
  double coupling = 1.0;          // eta = coupling i / k of Burton-Miller, > 0
  FaceRule rule;                  // of Burton-Miller's integrals
  double chief_spacing = 0.6;     // of CHIEF's points [wavelengths]: closer ones make the square form singular
  double chief_clearance = 0.15;  // of CHIEF's points from the skin [wavelengths]
  double grid_tolerance = 0.0;    // > 0: sums over all faces go through a grid and are that accurate (grid_spec.h)
};

enum class SolverKind {
  kLu,          // the matrix stored and factorised
  kGmres,       // the matrix stored, GMRES
  kMatrixFree,  // every entry computed again in every step, GMRES
  kFft,         // products by a grid and Fourier transforms, GMRES; the system has a grid_tolerance
};

enum class Precision { kSingle, kDouble };

/// LU; GMRES, stored; GMRES, matrix-free; GMRES, FFT.
std::string to_string(SolverKind kind);
/// single; double.
std::string to_string(Precision precision);

struct SolverOptions {
  SolverKind kind = SolverKind::kMatrixFree;
  Precision precision = Precision::kSingle;
  bool refine = true;       // continue until the residual by products in double meets the tolerance
  double tolerance = 1e-4;  // relative residual ||B p - b|| / ||b|| of every column
  int max_steps = 400;      // of GMRES, per column
  int restart = 100;        // steps after which GMRES restarts, which bounds its memory
  bool two_level = false;   // GMRES of Burton-Miller's equation takes the preconditioner of two_level.h
};

}  // namespace touchfield
