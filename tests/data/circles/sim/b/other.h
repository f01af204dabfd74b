#include "sim/a/two.h"
