#pragma once

#include <string>

namespace touchfield {

/// The kernels that OpenBLAS has chosen for this process, by its name for the processor ("SkylakeX", "Haswell", ...).
/// It chooses once, when it is loaded: by the processor's model, or as the environment variable OPENBLAS_CORETYPE says.
std::string blas_core();

/// The core that has kernels for the instruction sets of this processor, whatever its model. Empty unless those of
/// blas_core() use narrower registers. OpenBLAS takes processors newer than itself for a "Prescott" and then runs at a
/// tenth of their speed.
std::string better_blas_core();

/// The same for a core of that name, on a processor with these instruction sets.
///
/// wide   AVX-512 (level v4) in full-width units, as Intel's
std::string better_blas_core(const std::string& core, bool avx, bool avx2, bool wide);

/// The instructions that kernels of that core use and this processor lacks ("AVX-512"). A product would then end the
/// process. Empty if the processor has them all.
std::string lacking_instructions(const std::string& core);

/// One line for a user, with what mends it, if OpenBLAS runs slower kernels than the processor has. Likewise if it runs
/// other kernels than OPENBLAS_CORETYPE names. Empty otherwise, and where the user has chosen the slower ones by that
/// variable.
std::string blas_warning();

/// Where better_blas_core() names one, in a program that cannot be started again (restart_with_better_settings), such
/// as an interpreter that has loaded the library: OpenBLAS chooses again in this process. To be called before the first
/// product, and while no other thread computes.
void take_better_blas_core();

/// Who chose the core: "OpenBLAS", "touchfield" or "OPENBLAS_CORETYPE".
std::string blas_core_chosen_by();

/// How OpenBLAS runs threads: "OpenMP", "pthreads" or "none". Only the first shares the threads of our own loops.
std::string blas_threading();

}  // namespace touchfield
