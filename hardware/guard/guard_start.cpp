#include "hardware/guard/guard_start.h"

#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

pid_t start_apart(const std::vector<std::string>& command, const std::vector<int>& descriptors) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) {
    arguments.push_back(const_cast<char*>(word.c_str()));
  }
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  int place = kGuardDescriptor;
  for (const int descriptor : descriptors) {
    posix_spawn_file_actions_adddup2(&actions, descriptor, place++);
  }
  posix_spawn_file_actions_addclosefrom_np(&actions, place);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
  pid_t started = -1;
  const int error = ::posix_spawn(&started, command.front().c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw IoError(fmt::format("link guard: {} cannot be started: {}", command.front(), std::strerror(error)));
  }
  return started;
}

void require_handed_over(int count) {
  for (int descriptor = kGuardDescriptor; descriptor < kGuardDescriptor + count; ++descriptor) {
    struct stat status {};
    if (::fstat(descriptor, &status) != 0 || !S_ISSOCK(status.st_mode)) {
      throw InputError("link guard: touchfield starts it when it drives an array; it is not for use by hand");
    }
  }
}

void wake_at_parents_end() { ::prctl(PR_SET_PDEATHSIG, SIGCONT); }

}  // namespace touchfield
