// engine_test for systems whose positions show q' of blocks, too.
#define MIXED true
#define JETS_AND_COUNTS
#include "engine_test.cpp" // NOLINT(bugprone-suspicious-include)
