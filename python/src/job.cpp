#include "python/src/job.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <pthread.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>
#include <omp.h>

#include "sim/core/errors.h"
#include "sim/core/program_start.h"

namespace nb = nanobind;

namespace touchfield::python {

namespace {

using Milliseconds = std::chrono::milliseconds;

constexpr Milliseconds kLook{50};       // between looks for signals
constexpr Milliseconds kPatience{300};  // for work that was told to stop

std::atomic<int>& working() {
  static std::atomic<int> count{0};
  return count;
}

/// True in a child that was forked while another thread computed. Locks of that thread, of OpenMP and of OpenBLAS stay
/// as they were, with nobody to release them.
std::atomic<bool>& forked_amid_work() {
  static std::atomic<bool> forked{false};
  return forked;
}

/// Shared by the thread that works and the one that waits, whichever ends first.
struct Job {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  std::exception_ptr error;
  std::atomic<bool> stopped{false};
  std::vector<Remark> remarks;  // of the working thread alone until it is done
  std::string stage;            // with `mutex`, as the next two
  double fraction = 0;          // of the stage
  bool news = false;            // since the reporter heard of them
};

/// Borrowed: an object of Python must not end with its thread, without the interpreter.
PyObject*& reporter() {
  thread_local PyObject* function = nullptr;
  return function;
}

class StoppingProgress : public Progress {
 public:
  explicit StoppingProgress(Job& job) : job_(job) {}
  void begin(std::string_view what) override {
    look();
    const std::lock_guard lock(job_.mutex);
    job_.stage = what;
    job_.fraction = 0;
    job_.news = true;
  }
  void advance(double fraction) override {
    look();
    const std::lock_guard lock(job_.mutex);
    job_.news = job_.news || fraction != job_.fraction;
    job_.fraction = fraction;
  }
  void end(double /*seconds*/) override { look(); }
  void remark(std::string_view message) override {
    job_.remarks.push_back({Remark::Kind::kNote, std::string(message)});
  }
  void warn(std::string_view message) override {
    job_.remarks.push_back({Remark::Kind::kWarning, std::string(message)});
  }

 private:
  void look() const {
    if (job_.stopped) {
      throw Stopped{};
    }
  }

  Job& job_;
};

void work_on(const std::shared_ptr<Job>& job, int threads, Work work) {
  std::exception_ptr error;
  {
    static std::mutex turn;
    const std::lock_guard lock(turn);
    try {
      require_sound_variables();
      if (threads > 0) {
        omp_set_num_threads(threads);  // of this thread alone
      }
      take_blas_buffers(omp_get_max_threads());
      StoppingProgress progress(*job);
      progress.advance(0);
      work(progress);
    } catch (...) {
      error = std::current_exception();
    }
    work = nullptr;  // what it owns goes before anybody hears that it is done
  }
  const std::lock_guard lock(job->mutex);
  job->error = error;
  job->done = true;
  --working();
  job->changed.notify_all();
}

bool ended_within(Job& job, Milliseconds time) {
  const nb::gil_scoped_release released;
  std::unique_lock lock(job.mutex);
  return job.changed.wait_for(lock, time, [&] { return job.done; });
}

/// Tells the reporter of this thread what is new.
/// throws   nanobind's python_error, of the reporter
void report(Job& job) {
  if (reporter() == nullptr) {
    return;
  }
  std::string stage;
  double fraction = 0;
  {
    const std::lock_guard lock(job.mutex);
    if (!job.news) {
      return;
    }
    job.news = false;
    stage = job.stage;
    fraction = job.fraction;
  }
  const nb::object text = nb::steal(PyUnicode_DecodeFSDefault(stage.c_str()));
  if (!text.is_valid()) {
    throw nb::python_error();
  }
  nb::borrow(reporter())(text, fraction);
}

}  // namespace

void do_work(int threads, Work work) {
  if (forked_amid_work()) {
    throw std::runtime_error(
        "this process was forked while another thread computed, so it cannot compute; fork before the computation "
        "starts, or start processes by multiprocessing's \"spawn\"");
  }
  const auto job = std::make_shared<Job>();
  ++working();
  std::thread thread;
  try {
    thread = std::thread(work_on, job, threads, std::move(work));
  } catch (...) {
    --working();
    throw;
  }
  try {
    while (!ended_within(*job, kLook)) {
      if (PyErr_CheckSignals() != 0) {
        throw nb::python_error();
      }
      report(*job);
    }
  } catch (...) {
    job->stopped = true;
    if (ended_within(*job, kPatience)) {
      thread.join();
    } else {
      thread.detach();
    }
    throw;
  }
  thread.join();
  report(*job);
  for (const Remark& remark : job->remarks) {
    say(remark);
  }
  if (job->error) {
    std::rethrow_exception(job->error);
  }
}

int thread_count(std::optional<int> threads) {
  if (threads && (*threads < 1 || *threads > kMostThreads)) {
    throw InputError(fmt::format("threads = {} must be 1 to {}", *threads, kMostThreads));
  }
  return threads.value_or(0);
}

Reporting::Reporting(nb::handle progress) {
  if (!progress.is_none()) {
    context_ = nb::module_::import_("touchfield._progress").attr("reporting")(progress);
    context_.attr("__enter__")();
  }
}

Reporting::~Reporting() {
  try {
    if (context_.is_valid()) {
      context_.attr("__exit__")();
    }
  } catch (nb::python_error& error) {
    error.discard_as_unraisable("touchfield: progress");
  }
}

nb::object report_to(nb::object report) {
  PyObject* const before = reporter();
  reporter() = report.is_none() ? nullptr : report.ptr();
  return before == nullptr ? nb::none() : nb::borrow(before);
}

void watch_process() {
  pthread_atfork(nullptr, nullptr, [] {
    if (working() > 0) {
      forked_amid_work() = true;
      working() = 0;
    }
  });
  on_exit(
      [](int status, void*) {
        if (working() > 0) {  // it would read what the end of the process takes apart
          std::fflush(nullptr);
          _exit(status);
        }
      },
      nullptr);
}

}  // namespace touchfield::python
