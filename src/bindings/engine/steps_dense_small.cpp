#include "engine/steps.hpp"

VI_STEPS(, binding::dense_small)
