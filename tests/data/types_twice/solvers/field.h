#pragma once

namespace touchfield {
namespace {

class OwnInEachFile {};

}  // namespace

template <class T>
class Twice : public T {
  struct Inner {
    int value;
  };
};

}  // namespace touchfield
