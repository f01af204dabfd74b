#include "sim/core/progress.h"

namespace touchfield {

void Progress::begin(std::string_view) {}
void Progress::advance(double) {}
void Progress::end(double) {}
void Progress::note(std::string_view) {}
void Progress::warn(std::string_view) {}

}  // namespace touchfield
