// engine_test for systems whose positions show q' of blocks, too.
#define MIXED true
#include "engine_test.cpp" // NOLINT(bugprone-suspicious-include)
