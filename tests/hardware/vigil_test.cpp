#include "hardware/guard/vigil.h"

#include <csignal>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/testing.h"

namespace touchfield::vigil_test {

TEST(Silence, IsFoundWithin250Milliseconds) {
  Silence silence(7);
  double now = 7;
  do {
    now += kLookPeriod;
  } while (!silence.look(now, {}));
  EXPECT_GT(now - 7, 0.2);
  EXPECT_LE(now - 7, 0.25);
}

TEST(Silence, EndsWithASignOfLife) {
  Silence silence(0);
  double now = 0;
  for (int k = 0; k < 100; ++k) {
    for (int look = 0; look < 10; ++look) {
      now += kLookPeriod;
      EXPECT_FALSE(silence.look(now, {})) << now;
    }
    silence.heard(now);
  }
}

// Who was kept from running himself has not been there to hear.
TEST(Silence, APauseOfTheListenerIsNone) {
  Silence silence(0);
  EXPECT_FALSE(silence.look(5, {}));
  EXPECT_FALSE(silence.look(10, {}));
  EXPECT_FALSE(silence.look(15, {}));
  silence.heard(15);
  EXPECT_FALSE(silence.look(60, {}));
}

// A busy machine lets a process wait; one that works and says nothing hangs as much as one that sleeps.
TEST(Silence, WaitingForAProcessorIsNone) {
  Silence silence(0);
  double now = 0;
  for (int k = 0; k < 100; ++k) {
    now += kLookPeriod;
    EXPECT_FALSE(silence.look(now, {'R', 0.01})) << now;
  }
  const double start = now;
  double worked = 0.01;
  do {
    now += kLookPeriod;
    worked += kLookPeriod;
  } while (!silence.look(now, {'R', worked}));
  EXPECT_GT(now - start, 0.2 - 0.01 - 1e-9);
  EXPECT_LE(now - start, 0.25);
}

TEST(Vigil, SeesThatAProcessIsStopped) {
  const pid_t child = ::fork();
  if (child == 0) {
    for (;;) ::pause();
  }
  Vigil vigil(child, 0);
  EXPECT_EQ(vigil.fault(0.01), std::nullopt);
  ::kill(child, SIGSTOP);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, WUNTRACED), child);
  EXPECT_EQ(vigil.fault(0.02), "was stopped by a signal");
  vigil.resume();
  ASSERT_EQ(::waitpid(child, &status, WCONTINUED), child);
  EXPECT_EQ(vigil.fault(0.03), std::nullopt);
  ::kill(child, SIGKILL);
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(vigil.fault(0.04), std::nullopt) << "that it is gone is told by its channel";
  EXPECT_THROW(Vigil(child, 0), IoError);
}

// A tracer stops a process for a moment at each of its calls: only one that is held is not there.
TEST(Vigil, TellsOfADebugger) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    ::raise(SIGTRAP);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSTOPPED(status));
  double now = 0;
  Vigil vigil(child, now);
  std::optional<std::string> fault;
  while (!(fault = vigil.fault(now += kLookPeriod))) {
  }
  EXPECT_EQ(fault, "was held by a debugger");
  EXPECT_GT(now, 0.2);
  ::ptrace(PTRACE_DETACH, child, nullptr, nullptr);
  ASSERT_EQ(::waitpid(child, &status, 0), child);
}

}  // namespace touchfield::vigil_test
