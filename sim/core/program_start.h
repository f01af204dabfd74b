#pragma once

#include <string>

/// How a program that computes has to start: threads that let others work, OpenBLAS with the kernels of this processor
/// and with room for its buffers. OpenBLAS and GNU's OpenMP read what they need once, when they are loaded.
namespace touchfield {

/// The variable that tells OpenMP how often a waiting thread looks for the others before it sleeps. Without it threads
/// look for milliseconds: where other programs want the cores too, a run takes many times as long. Threads that sleep
/// at once take twice as long on an idle machine. kSpins is near the better on either (results/tables/waiting.csv).
inline constexpr const char* kSpinsVariable = "GOMP_SPINCOUNT";
inline constexpr int kSpins = 4000;

/// The most threads that may be asked for: OpenMP keeps a record of each on the stack, and crashes where that is full.
inline constexpr int kMostThreads = 4096;

/// Starts this program again, once, with kSpins, and with OPENBLAS_CORETYPE where better_blas_core() names one. What
/// the user has set, or says by OMP_WAIT_POLICY, stays. Returns where there is nothing to set or it cannot be started
/// again. To be called first thing in main, before threads and files.
void restart_with_better_settings(char** argv);

/// Lets this thread, and what it starts, run on all processors that OpenMP was given. OMP_PROC_BIND, OMP_PLACES and
/// GOMP_CPU_AFFINITY bind the first thread to one of them when OpenMP is loaded.
void restore_processors();

/// One line for a user where OMP_PROC_BIND, OMP_PLACES or GOMP_CPU_AFFINITY have so many threads share processors; else
/// empty.
std::string binding_warning(int threads);

/// Checks the variables that libraries take without a check, and then crash by.
/// throws   InputError if OMP_NUM_THREADS is above kMostThreads, or the processor lacks what OPENBLAS_CORETYPE needs
void require_sound_variables();

/// The kernels that OpenBLAS runs, by its name for a processor ("SkylakeX"), and who chose them: "OpenBLAS",
/// "touchfield" or "OPENBLAS_CORETYPE".
std::string blas_core();
std::string blas_core_chosen_by();
/// The core with kernels for the widest registers of this processor; empty unless blas_core() uses narrower ones.
/// OpenBLAS takes processors newer than itself for a slow "Prescott".
std::string better_blas_core();
/// One line for a user, with what mends it, where there is a better core; empty if the user has chosen this one.
std::string blas_warning();

/// Has OpenBLAS take better_blas_core() in an interpreter, which cannot be started again. To be called before the first
/// product, and while no other thread computes.
void take_better_blas_core();
/// How OpenBLAS runs threads: "OpenMP", "pthreads" or "none". Only the first shares the threads of our own loops.
std::string blas_threading();

/// What the limits of this process leave too little of, with what mends it; empty if the libraries fit. OpenBLAS takes
/// a buffer for each thread when it is loaded; where that is refused it tries for ever. May be asked before that.
/// environment   as main gets it
std::string missing_room(char** environment);

/// Where memory is limited, has OpenBLAS take all buffers that so many threads may need, before other data take the
/// room.
/// throws   std::runtime_error if they do not fit; it names the limit and what mends it
void take_blas_buffers(int threads);

/// Memory that this process may still take by its limits [bytes]; infinite without one.
double memory_below_limit();
/// One line for a computation that found no memory, which names the limit if there is one.
std::string out_of_memory();

}  // namespace touchfield
