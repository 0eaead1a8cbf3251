// The measured peak of one core: multiplications and additions per second, in doubles.
//
// Method    n products x <- x c and as many sums y <- y + d, each waiting only for itself, in
//           registers of `width` doubles; the best of several n, of `rounds` rounds each.
//           Nothing is fused: the library rounds a b + c twice, so a core that can fuse gets no
//           credit for it here.
// Assumes   some n covers latency times units and still fits the registers, constants included.
// Output    width, then 10^9 operations per second, one number a line.
// Fails     ends by the signal for an illegal instruction on a processor that lacks those it was
//           compiled for.
#include <algorithm>
#include <chrono>
#include <cstdio>

namespace {

#if defined(__AVX512F__)
constexpr int width = 8;
#elif defined(__AVX2__)
constexpr int width = 4;
#else
constexpr int width = 2;
#endif
constexpr int rounds = 20;
constexpr long steps = 1'000'000;

typedef double vector __attribute__((vector_size(width * sizeof(double))));

// 10^9 operations per second of one round; the ends of the chains go into `sum`: none is left out.
template <int n>
double round_of(vector factor, vector term, vector& sum) {
    vector x[n], y[n];
    for (int i = 0; i < n; ++i) {
        x[i] = factor + i;
        y[i] = term * i;
    }
    const auto begin = std::chrono::steady_clock::now();
    for (long k = 0; k < steps; ++k) {
#pragma GCC unroll 16
        for (int i = 0; i < n; ++i) {
            x[i] = x[i] * factor;
            y[i] = y[i] + term;
        }
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    for (int i = 0; i < n; ++i)
        sum += x[i] + y[i];
    return 2e-9 * n * width * steps / spent.count();
}

} // namespace

int main(int argc, char**) {
    const double hidden = argc * 0x1p-50; // unknown to the compiler; the chains stay finite
    vector factor{}, term{}, sum{};
    factor += 1.0 + hidden;
    term += hidden;
    double best = 0.0;
    for (int r = 0; r < rounds; ++r)
        best = std::max({best, round_of<4>(factor, term, sum), round_of<5>(factor, term, sum),
                         round_of<6>(factor, term, sum), round_of<7>(factor, term, sum),
                         round_of<8>(factor, term, sum), round_of<12>(factor, term, sum)});
    std::printf("%d\n%.3f\n", width, best);
    return sum[0] > 0.0 ? 0 : 1;
}
