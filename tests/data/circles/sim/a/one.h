#include "sim/b/other.h"
