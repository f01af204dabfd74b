#pragma once

#include <string>
#include <string_view>

namespace touchfield {

/// To be called first: a standard stream that is closed is held open, so that no result file gets its number. A reader
/// that goes away ends no computation, a limit on the size of files is an error of writing (SIGPIPE, SIGXFSZ are
/// ignored).
void hold_standard_streams();

/// Prints on standard output, and on standard error. Neither throws: what has been computed must not be lost because
/// nobody listens. A stream that does not take everything is reported by finish_output().
void put(std::string_view text);
void say(std::string_view text);

/// Says "touchfield: warning: TEXT".
void say_warning(const std::string& text);

/// Empties the line that a terminal shows last of standard error.
void clear_line();

/// To be called last, with the exit code so far.
/// returns  that code; 1 instead of 0 if a standard stream was full or closed, which the other one then says
int finish_output(int code);

}  // namespace touchfield
