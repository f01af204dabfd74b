#pragma once

#include <string_view>

namespace touchfield {

/// Hears what a long computation is doing. The default hears nothing.
class Progress {
 public:
  Progress() = default;
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  virtual ~Progress() = default;

  /// A stage begins; what: a short description, e.g. "factorise B (10,512 unknowns)".
  virtual void begin(std::string_view /*what*/) {}
  /// The fraction of the stage that is done, 0 to 1. Called from one thread.
  virtual void advance(double /*fraction*/) {}
  /// The stage is done after this many seconds.
  virtual void end(double /*seconds*/) {}
  /// A figure worth a line that is no stage.
  virtual void note(std::string_view /*line*/) {}
  /// A figure of how a stage was solved: for a log, and for those who ask.
  virtual void detail(std::string_view /*line*/) {}
  /// Something worth knowing about the result, which it leaves as trustworthy as it is.
  virtual void remark(std::string_view /*message*/) {}
  /// Something the user should know that is no error.
  virtual void warn(std::string_view /*message*/) {}
};

}  // namespace touchfield
