#include "sim/bem/pair_loops.h"

#include "sim/bem/pair_loops_table.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

const PairLoopTable& pair_loops(InstructionLevel level) {
  switch (level) {
#ifdef __x86_64__
    case InstructionLevel::kV2:
      return v2::kPairLoops;
    case InstructionLevel::kV3:
      return v3::kPairLoops;
    case InstructionLevel::kV4:
      return v4::kPairLoops;
#endif
    default:
      return generic::kPairLoops;
  }
}

namespace {

const PairLoopTable& loops() {
  static const PairLoopTable& chosen = pair_loops(instruction_level());
  return chosen;
}

const PairLoopTableOf<float>& of(float /*unused*/) { return loops().of_float; }
const PairLoopTableOf<double>& of(double /*unused*/) { return loops().of_double; }

}  // namespace

template <typename Real>
void pair_values(Layer layer, const PairConstants<Real>& constants, const PairPoint<Real>& point,
                 const PairSources<Real>& sources, int count, Real* re, Real* im) {
  of(Real()).values(layer, constants, point, sources, count, re, im);
}

template void pair_values<float>(Layer, const PairConstants<float>&, const PairPoint<float>&, const PairSources<float>&,
                                 int, float*, float*);
template void pair_values<double>(Layer, const PairConstants<double>&, const PairPoint<double>&,
                                  const PairSources<double>&, int, double*, double*);

template <typename Real>
void add_mutual_sums(Layer layer, bool transposed, const PairConstants<Real>& constants, const PairPoint<Real>& point,
                     const PairSources<Real>& sources, int count, const MutualSums<Real>& sums) {
  of(Real()).add_mutual(layer, transposed, constants, point, sources, count, sums);
}

template void add_mutual_sums<float>(Layer, bool, const PairConstants<float>&, const PairPoint<float>&,
                                     const PairSources<float>&, int, const MutualSums<float>&);
template void add_mutual_sums<double>(Layer, bool, const PairConstants<double>&, const PairPoint<double>&,
                                      const PairSources<double>&, int, const MutualSums<double>&);

template <typename Real>
PairProducts<Real> pair_products(const Real* a_re, const Real* a_im, const Real* b_re, const Real* b_im, int count) {
  return of(Real()).products(a_re, a_im, b_re, b_im, count);
}

template PairProducts<float> pair_products(const float*, const float*, const float*, const float*, int);
template PairProducts<double> pair_products(const double*, const double*, const double*, const double*, int);

void static_values(Layer layer, double gamma, const PairPoint<double>& point, const PairSources<double>& sources,
                   int count, double* re, double* im) {
  loops().fixed_values(layer, gamma, point, sources, count, re, im);
}

double static_sum(const PairPoint<double>& point, const PairSources<double>& sources, const double* weight, int count) {
  return loops().fixed_sum(point, sources, weight, count);
}

int near_sources(const PairPoint<double>& point, const PairSources<double>& sources, const double* reach_squared,
                 int count, int* near) {
  return loops().near(point, sources, reach_squared, count, near);
}

}  // namespace touchfield
