// Work in a process of its own: what it gives comes back, and nothing else of what it does.

#include "sim/core/isolated_work.h"

#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/testing.h"

namespace touchfield::isolated_work_test {

constexpr WorkLimits kLimits = {.memory = 64 << 20, .output = 1 << 20, .seconds = 1};

std::string error_of(const std::function<void(const Emit&)>& work) {
  return message_of<InputError>([&] { isolated("the work", kLimits, work); });
}

TEST(IsolatedWork, GivesItsPiecesInOrder) {
  std::string expected;
  for (int i = 0; i < 5000; ++i) {
    expected += std::to_string(i) + std::string(static_cast<std::size_t>(i % 90), 'x');
  }
  const WorkOutput output = isolated("the work", kLimits, [&](const Emit& emit) {
    emit("");
    emit(std::string_view(expected).substr(0, 7));
    emit(std::string_view(expected).substr(7, 200'000));  // longer than what is gathered before it is written
    emit(std::string_view(expected).substr(200'007));
  });
  EXPECT_EQ(output.bytes, expected);
  EXPECT_EQ(isolated("the work", kLimits, [](const Emit&) {}).bytes, "");
}

TEST(IsolatedWork, ChangesNothingHere) {
  int number = 1;
  isolated("the work", kLimits, [&](const Emit&) { number = 2; });
  EXPECT_EQ(number, 1);
}

TEST(IsolatedWork, WorksBesideThreads) {
  for (int round = 0; round < 20; ++round) {
    int sum = 0;
#pragma omp parallel for reduction(+ : sum)
    for (int i = 0; i < 100; ++i) {
      sum += i;
    }
    const WorkOutput output =
        isolated("the work", kLimits, [&](const Emit& emit) { emit(std::to_string(sum) + std::string(100'000, ' ')); });
    EXPECT_THAT(std::string(output.bytes), StartsWith("4950 "));
  }
}

TEST(IsolatedWork, ItsExceptionsAreInputErrors) {
  EXPECT_EQ(error_of([](const Emit& emit) {
              emit("begun");
              throw std::runtime_error("x.h5: wrong");
            }),
            "x.h5: wrong");
}

TEST(IsolatedWork, ACrashIsAnError) {
  EXPECT_THAT(error_of([](const Emit&) {
                std::signal(SIGSEGV, SIG_DFL);  // a sanitizer has a handler of its own
                std::raise(SIGSEGV);
              }),
              HasSubstr("the work ends by signal 11"));
  EXPECT_EQ(error_of([](const Emit&) { std::_Exit(3); }), "the work ends with exit code 3");
}

TEST(IsolatedWork, AnEndlessLoopIsAnError) {
  EXPECT_EQ(error_of([](const Emit&) {
              const volatile bool for_ever = true;
              while (for_ever) {
              }
            }),
            "the work takes more than 1 s");
}

TEST(IsolatedWork, ASleepThatNeverEndsIsAnError) {
  EXPECT_EQ(error_of([](const Emit&) {
              while (true) {
                sigset_t none;
                sigemptyset(&none);
                sigsuspend(&none);
              }
            }),
            "the work takes more than 1 s");
}

TEST(IsolatedWork, TooMuchMemoryIsAnError) {
#ifdef TOUCHFIELD_ADDRESS_SANITIZER
  GTEST_SKIP() << "the sanitizer's allocator ends a process that lacks memory";
#endif
  EXPECT_EQ(error_of([](const Emit& emit) {
              const std::vector<char> much(std::size_t{128} << 20, 'x');
              emit(std::string_view(much.data(), 1));
            }),
            "the work needs more than 64 MiB of memory");
}

TEST(IsolatedWork, TooMuchOutputIsAnError) {
  EXPECT_EQ(error_of([](const Emit& emit) {
              for (int i = 0; i < 20; ++i) {
                emit(std::string(100'000, 'x'));
              }
            }),
            "the work gives more than 1 MiB");
}

}  // namespace touchfield::isolated_work_test
