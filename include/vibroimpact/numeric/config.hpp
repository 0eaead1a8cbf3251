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

// VI_WITHIN marks a lambda of such a function: [&](auto j) VI_WITHIN { ... }
#define VI_WITHIN __attribute__((always_inline))

// VI_RARE marks a function that the inner loop seldom calls, and that would stand in its way. As it is called,
// not copied, a program may compile it once for several callers.
#define VI_RARE VI_HD __attribute__((noinline))

// VI_APART marks a part of that loop which is a function of its own on a device, where registers are
// few.
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define VI_APART VI_RARE
#else
#define VI_APART VI_HOT
#endif

// VI_CALL marks a large function that is to be called on a device, where compilers would copy it to
// each of its callers: they, and the spilling of registers, take several times as long then.
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define VI_CALL VI_HD inline __attribute__((noinline))
#else
#define VI_CALL VI_HD inline
#endif
