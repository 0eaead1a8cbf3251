// Compiler differences that every header needs to know about.
#pragma once

// VI_HD marks a function that also runs on a CUDA device; elsewhere it is empty.
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define VI_HD __host__ __device__
#else
#define VI_HD
#endif
