// Compiler differences that every header needs to know about.
#pragma once

// VI_HD marks a function that also runs on a CUDA device; elsewhere it is empty.
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define VI_HD __host__ __device__
#else
#define VI_HD
#endif

// VI_HOT marks a function of the quick flight's inner loop: it is inlined whatever its size, so that
// states stay in registers instead of being copied between calls.
#define VI_HOT VI_HD inline __attribute__((always_inline))
