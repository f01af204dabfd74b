#include "apps/commands/claimed_directory.h"

#include <filesystem>

#include <fmt/format.h>

#include "apps/commands/interrupt_guard.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"

namespace touchfield {

void require_apart(const std::string& output, const std::string& images) {
  std::error_code none;
  if (std::filesystem::equivalent(output, images, none)) {
    throw InputError(fmt::format("-o {}: the folder of the images, must be another one", output));
  }
}

ClaimedDirectory::ClaimedDirectory(const std::string& kept) {
  block_interrupts();
  handle_interrupts([open = open_, kept](const char* signal_name) {
    const std::lock_guard lock(open->mutex);
    if (open->directory) {
      open->directory->fail(fmt::format("interrupted by {}", signal_name));
      say(fmt::format("\ntouchfield: interrupted; {}\n",
                      fmt::format(fmt::runtime(kept), open->directory->file("failed.json"))));
    } else {
      say("\ntouchfield: interrupted before anything was written\n");
    }
  });
}

RunDirectory& ClaimedDirectory::claim(const std::string& output, bool force, const std::string& name,
                                      const std::vector<std::string>& files) {
  const std::lock_guard lock(open_->mutex);
  open_->directory = std::make_shared<RunDirectory>(
      output.empty() ? RunDirectory::next_free("results/runs", name, files) : RunDirectory::at(output, files, force));
  return *open_->directory;
}

void ClaimedDirectory::fail(const std::string& reason, Progress& progress) {
  try {
    open_->directory->fail(reason);
  } catch (const IoError& error) {  // the disk may be full; the first error is the one to report
    progress.warn(error.what());
  }
}

void ClaimedDirectory::release() {
  const std::lock_guard lock(open_->mutex);
  open_->directory.reset();
}

}  // namespace touchfield
