// Builds of the kernel that this processor runs, best first.
#pragma once

#include <string>
#include <vector>

inline std::vector<std::string> supported_targets() {
    std::vector<std::string> out;
#if defined(__x86_64__)
    __builtin_cpu_init();
    const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        out.push_back("avx512");
    if (avx2) out.push_back("avx2");
#endif
    out.push_back("baseline");
    return out;
}
