#pragma once

#include <functional>
#include <memory>
#include <nanobind/nanobind.h>
#include <optional>
#include <string>
#include <utility>

#include "sim/core/progress.h"

namespace touchfield::python {

/// What a computation ends by when Python was interrupted. No std::exception, so that nothing on the way takes it for
/// an error to go on from.
struct Stopped {};

/// What is to be said of a result beside it.
struct Remark {
  enum class Kind { kWarning, kNote };
  Kind kind;
  std::string text;
};

/// Hands a remark to Python's warnings.warn, as a TouchfieldWarning or a TouchfieldNote.
/// throws   nanobind's python_error where a filter makes it an error
void say(const Remark& remark);

using Work = std::function<void(Progress&)>;

/// Does work on a thread of its own while this one lets go of the interpreter and looks for signals. On Ctrl-C the work
/// is told so by its Progress, which throws Stopped; work that does not hear of it within a moment is left to end by
/// itself. One piece of work is done at a time: the next one waits.
///
/// Warnings and notes of the Progress are said when the work has ended. Stages and fractions go to the reporter of this
/// thread, at most 20 per second; an exception that it raises stops the work.
///
/// threads   of OpenMP and OpenBLAS; 0: as many as OMP_NUM_THREADS or the processor says
/// work      must own what it reads, and touch nothing of Python's
/// throws    what the work throws; nanobind's python_error on a signal whose handler raises; std::runtime_error in a
///           process that was forked while another thread computed
void do_work(int threads, Work work);

/// The same for work that returns something.
template <typename Make>
auto computed(int threads, Make make) {
  auto result = std::make_shared<std::optional<decltype(make(std::declval<Progress&>()))>>();
  do_work(threads, [result, make = std::move(make)](Progress& progress) { result->emplace(make(progress)); });
  return std::move(**result);
}

/// The argument `threads` of a function of Python's: none is 0.
/// throws   InputError unless it is 1 to 4096
int thread_count(std::optional<int> threads);

/// While it lasts, computations of this thread report to the argument `progress` of a function: a function of stage and
/// fraction, True for a bar, None for nobody (touchfield/_progress.py).
class Reporting {
 public:
  /// throws   nanobind's python_error on anything else
  explicit Reporting(nanobind::handle progress);
  ~Reporting();
  Reporting(const Reporting&) = delete;
  Reporting& operator=(const Reporting&) = delete;

 private:
  nanobind::object context_;
};

/// Sets the function that hears of the progress of this thread's computations, by stage and fraction; none: nobody.
///
/// report    stays alive as long as it is set
/// returns   the one before
nanobind::object report_to(nanobind::object report);

/// Has the process end without waiting for work that was left, once it ends, and a child that is forked amid work know
/// of it.
void watch_process();

}  // namespace touchfield::python
