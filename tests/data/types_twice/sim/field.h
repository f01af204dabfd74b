#pragma once

namespace touchfield {

class Declared;

/// Also in solvers/field.h.
struct Twice {
  struct Inner {
    int value;
  };
};

}  // namespace touchfield
