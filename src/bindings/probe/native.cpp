// Prints the best build of the kernel for this machine; CMake runs it.
#include <cstdio>

#include "targets.hpp"

int main() {
    std::fputs(supported_targets().front().c_str(), stdout);
}
