#pragma once

#include <exception>
#include <string>

#include <gtest/gtest.h>

namespace touchfield::support {

/// What an action's error of this type says; anything else fails the test.
template <class Error, class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "another error: " << error.what();
    return {};
  }
  ADD_FAILURE() << "no error";
  return {};
}

}  // namespace touchfield::support
