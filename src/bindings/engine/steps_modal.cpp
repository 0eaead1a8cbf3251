#include "engine/steps.hpp"

VI_STEPS(, binding::modal)
