#include "sim/bem/scheme.h"

namespace touchfield {

std::string to_string(Scheme scheme) {
  switch (scheme) {
    case Scheme::kPaper:
      return "paper";
  }
  return {};
}

}  // namespace touchfield
