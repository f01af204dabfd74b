#pragma once

#include <string>
#include <sys/types.h>
#include <vector>

namespace touchfield {

/// The first descriptor that a program started here finds.
inline constexpr int kGuardDescriptor = 3;

/// Starts a program in a session of its own, where no signal of a terminal reaches it. Of what is open here it has but
/// standard error and the descriptors below: a reader of this program's output does not wait for it.
///
/// command       program and arguments
/// descriptors   it finds them as kGuardDescriptor and those that follow; none may be below the place it goes to
/// throws        IoError if it cannot be started
pid_t start_apart(const std::vector<std::string>& command, const std::vector<int>& descriptors);

/// In a program that was started so: refuses to continue without the sockets it was to be handed.
/// throws   InputError
void require_handed_over(int count);

/// In a program that was started so: if it is stopped when the one who started it ends, it continues, and can see that.
void wake_at_parents_end();

}  // namespace touchfield
