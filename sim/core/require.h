#pragma once

#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

/// Holds a user's input to a rule. The arguments are evaluated in any case.
///
/// rule     what is wrong and what must hold, as fmt::format takes it with the arguments
/// throws   InputError with this text unless `holds`
template <class Condition, class... Values>
void require(const Condition& holds, fmt::format_string<Values...> rule, Values&&... values) {
  if (!holds) [[unlikely]] {
    throw InputError(fmt::format(rule, std::forward<Values>(values)...));
  }
}

}  // namespace touchfield
