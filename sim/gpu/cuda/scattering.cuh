#pragma once

#include <memory>
#include <vector>

#include "sim/gpu/cuda/block_gmres.cuh"
#include "sim/gpu/cuda/boundary.cuh"
#include "sim/gpu/cuda/products.cuh"
#include "sim/gpu/cuda/sources.cuh"
#include "sim/gpu/cuda/two_level.cuh"

namespace touchfield::cuda {

/// GpuBody: what ScatteringSystem, its solver and make_transfer do, put together from the parts beside it.
class Scattering final : public GpuBody {
 public:
  Scattering(Context& context, const GpuBodySpec& spec);

  void move(const double* vertices) override;
  void set_sources(const GpuSources& sources) override;
  GpuSolveReport solve(const GpuComplex* drives, int columns, bool warm, const GpuSolveOptions& options,
                       const GpuProgress& progress) override;
  Span span(double tolerance, const GpuSolveOptions& options, const GpuProgress& progress) override;
  void pressures(GpuComplex* all) override;
  void rows(const int* faces, int count, GpuComplex* rows) override;
  Reduction reduce(const double* weights, double tolerance) override;
  void reduced(GpuComplex* rows) override;
  std::unique_ptr<GramDevice> incident_gram(const int* faces, int count, const double* amplitudes,
                                            const double* weights, const GpuComplex* beyond, bool scattered) override;
  GpuSolveReport transfer_rows(const int* faces, int count, GpuComplex* rows, const GpuSolveOptions& options,
                               const GpuProgress& progress) override;

 private:
  /// One block of columns of B x = b, or B^T x = b.
  struct Block {
    bool transposed;
    int columns;
    const cuComplex* b;
    cuComplex* x;
    bool warm;
  };

  std::size_t panel_bytes() const;
  Boundary& boundary();
  Boundary& plain() { return made(plain_, Equation::kPaperCorrected); }
  Boundary& made(std::unique_ptr<Boundary>& boundary, Equation equation);
  const Sources& sources() const;
  double gamma() const { return spec_.coupling / spec_.k; }
  void make_field();
  const cuComplex* right_sides() const { return spec_.burton_miller ? b_.data() : g_.data(); }
  std::vector<double> eigen(int size, Array<cuDoubleComplex>& matrix);
  void to_channels(const cuDoubleComplex* rows, int count, GpuComplex* out);
  void channels_gram(Array<cuDoubleComplex>& gram);
  void pressure_gram(const Array<double>& root, Array<cuDoubleComplex>& gram);
  const Array<cuComplex>& pressure() const { return spec_.polished ? p_ : x_; }
  void polish(const cuComplex* drives, int columns, double tolerance);
  GpuSolveReport pressures_of(const cuComplex* drives, int columns, bool warm, const GpuSolveOptions& options,
                              const GpuProgress& progress);
  GpuSolveReport solve_columns(const Block& all, const GpuSolveOptions& options, const GpuProgress& progress);
  void solve_block(const Block& block, const GpuSolveOptions& options, const GpuProgress& progress,
                   GpuSolveReport& report);
  GmresReport solve_by_two_levels(const Block& block, const BlockProduct& apply, const GmresLimits& limits,
                                  GpuSolveOptions::Kind kind, const GpuProgress& progress);
  bool make_two_level();
  double step_seconds(GpuSolveOptions::Kind kind, int columns) const;
  void factorise();
  int rough_columns(const double* shares, int columns, double tolerance) const;
  bool has_current_factors() const { return has_factors_ && factors_are_current_; }
  void drop_factors();
  GpuSolveOptions::Kind prepare(GpuSolveOptions::Kind wanted, int columns);
  bool is_wide(int columns) const;
  void invert_for(int columns);
  void invert();
  bool grid_pays(int columns);
  void go_through_grid();
  void leave_grid();
  void copy(const cuComplex* from, cuComplex* to, std::size_t count);
  void set_units(const int* faces, int count, Array<cuComplex>& units);
  double matrix_bytes() const { return 8.0 * spec_.faces * spec_.faces; }
  bool fits(double bytes) const;

  Context& context_;
  GpuBodySpec spec_;  // its pointers are not read after construction
  Faces faces_;
  std::unique_ptr<GridSums> grid_;              // of both, where they go through it
  std::unique_ptr<Boundary> boundary_, plain_;  // made when needed
  std::unique_ptr<Sources> sources_;
  bool has_field_ = false;
  Array<cuComplex> g_{context_};  // incident pressure of every channel, M x N
  Array<cuComplex> b_{context_};  // its right-hand sides where they are others
  BlockGmres gmres_{context_};
  bool has_two_level_ = true;            // unless it has failed this body
  bool two_level_is_current_ = false;    // else of B where the body was
  std::unique_ptr<TwoLevel> two_level_;  // of boundary_, made when it pays
  Lu lu_{context_};
  bool has_factors_ = false;
  bool factors_are_current_ = false;  // else of B where the body was
  Array<cuComplex> factors_{context_};
  Array<cuComplex> inverse_{context_};  // of B where the body was; of no size if there is none
  HermitianSolver hermitian_{context_};
  int columns_ = 0;               // of P
  Array<cuComplex> x_{context_};  // solution of B x = b, M x S: P itself where nothing is polished
  Array<cuComplex> p_{context_};  // P where it is
  std::vector<double> shares_;    // of the columns that were solved for, as GmresReport has them
  Array<cuComplex> right_{context_}, polished_{context_}, drives_{context_};
  Array<cuDoubleComplex> reduced_{context_};  // rows whose products with V^H are R
  Array<cuDoubleComplex> host_{context_};     // on the way to and from the host
};

}  // namespace touchfield::cuda
