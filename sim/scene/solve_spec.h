#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/bem/bem_options.h"
#include "sim/bem/scheme.h"
#include "sim/gpu/compute_device.h"
#include "sim/scene/body_spec.h"
#include "solvers/phase/phase_methods.h"

namespace touchfield {

/// Where an iterative method starts from.
struct StartSpec {
  enum class Kind {
    kAuto,  // of surface the most promising of some annealed starts; of the others zero
    kZero,
    kRandom,
    kAdjoint,   // the field sent back from the target
    kSpectral,  // the relaxed problem's own answer
    kPrevious,  // the phases of a run
  };
  Kind kind = Kind::kAuto;
  unsigned seed = 0;   // of kRandom
  int restarts = 1;    // of kRandom: seeds seed, seed + 1, ...; the best solution is kept
  std::string file;    // of kPrevious: run.h5
  bool among = false;  // of kPrevious: its phases are one of the starts that kAuto tries
  std::string method;  // of kPrevious: whose phases; empty: the method of the same name, or else the first
};

inline constexpr Scheme kDefaultScheme = Scheme::kBurtonMillerPolished;

struct MethodSpec {
  const PhaseMethod* kind = &phase_method("paper");
  std::string name;  // `as`, or the method's own name
  Scheme scheme = kDefaultScheme;
  int iterations = MethodSettings{}.iterations;  // of an iterative method
  StartSpec start;
  bool free_amplitudes = false;                 // of surface
  bool free_level = true;                       // of surface
  std::optional<ChannelTolerances> tolerances;  // of surface: the expected misfit is minimised
  FaceWeights faces = FaceWeights::kEqual;      // of paper and unscattered
  std::vector<double> phases;                   // of `fixed`: one for all, or one per channel [rad]
};

enum class SolverChoice { kAuto, kLu, kGmres, kMatrixFree, kFft };  // gmres: with a stored matrix
enum class PrecisionChoice { kAuto, kDouble, kSingle };
enum class ResonanceCheck { kAuto, kAlways, kNever };

/// How the equations of the boundary elements, B p = b, are set up and solved.
struct SolverSpec {
  ComputeDevice device{};
  SolverChoice solver = SolverChoice::kAuto;
  PrecisionChoice precision = PrecisionChoice::kAuto;
  double tolerance = SolverOptions{}.tolerance;  // |b - B p| / |b| of an iterative solution
  bool refine = SolverOptions{}.refine;       // single precision: until the residual computed in double is that small
  int max_steps = SolverOptions{}.max_steps;  // of GMRES
  ResonanceCheck resonance_check =
      ResonanceCheck::kAuto;                   // whether the plain and the Burton-Miller pressures are compared
  double coupling = SystemOptions{}.coupling;  // of Burton-Miller: eta = coupling i/k
  double split_ratio =
      FaceRule{}.split_ratio;  // near faces are split while distance < split_ratio sqrt(area of the piece)

  bool operator==(const SolverSpec&) const = default;
};

struct SolveSpec {
  std::vector<MethodSpec> methods;  // defaults of `solve` filled in
  Scheme scheme = kDefaultScheme;
  int iterations = MethodSettings{}.iterations;
  StartSpec start;
  double outside_weight = 1.0;     // of pressure outside the target, in surface and lbfgs
  bool optimality_bound = false;   // whether a lower bound of surface's cost is computed
  bool allow_coarse_mesh = false;  // whether a mesh that is too coarse at the target is solved all the same
  SolverSpec solver;
};

/// Edges of whole bodies away from the target, up to which an evaluation's pressure counts [wavelengths].
inline constexpr double kCoarsestEvaluation = 0.35;

/// The model whose pressures a result is evaluated by.
struct EvaluationSpec {
  enum class Kind {
    // kSame of whole bodies with edges of at most kCoarsestEvaluation wavelengths, else kEdge; build_model decides
    kAuto,
    kNone,
    kSame,   // the model that was solved
    kEdge,   // the same body meshed again
    kSplit,  // the same mesh with every face in four
  };
  Kind kind = Kind::kAuto;
  Scheme scheme = kDefaultScheme;  // of kEdge and kSplit
  EdgeSpec edge;                   // of kEdge
  int splits = 1;                  // of kSplit: how often
};

}  // namespace touchfield
