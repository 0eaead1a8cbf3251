// repetition_test for systems whose positions show q' of blocks, too.
#define MIXED true
#include "repetition_test.cpp" // NOLINT(bugprone-suspicious-include)
