// Prints a b + c with one rounding of given numbers, as hexadecimal floats.
//
// Reads lines "a b c" and writes what whole numbers give, what sums and products without error give and
// what this target's fma gives. Checks on the way that every lane of packs of 2, 4, 8 has the bits of fma and fnma; returns 1 if not.
#include <cstdio>
#include <cstring>

#include "vibroimpact/numeric/pack.hpp"

namespace {

// Equal bits; any NaN equals any other.
bool same(double x, double y) {
    return (x != x && y != y) || std::memcmp(&x, &y, sizeof x) == 0;
}

// Lane i holds the numbers multiplied by powers of two and signs of its own.
template <int N>
bool lanes_agree(double a, double b, double c) {
    vi::pack<N> pa, pb, pc;
    for (int i = 0; i < N; ++i) {
        set_lane(pa, i, i % 2 ? -a : a);
        set_lane(pb, i, i % 4 < 2 ? b : 0.5 * b);
        set_lane(pc, i, i % 3 ? c : -c);
    }
    const auto sum = fma(pa, pb, pc), difference = fnma(pa, pb, pc);
    for (int i = 0; i < N; ++i) {
        const double x = lane(pa, i), y = lane(pb, i), z = lane(pc, i);
        if (!same(lane(sum, i), vi::fma(x, y, z)) || !same(lane(difference, i), vi::fnma(x, y, z)))
            return false;
    }
    return true;
}

} // namespace

int main() {
    double a, b, c;
    while (std::scanf("%la %la %la", &a, &b, &c) == 3) {
        if (!lanes_agree<2>(a, b, c) || !lanes_agree<4>(a, b, c) || !lanes_agree<8>(a, b, c)) {
            std::fprintf(stderr, "lanes disagree: %a %a %a\n", a, b, c);
            return 1;
        }
        std::printf("%a %a %a\n", vi::detail::fma_in_whole_numbers(a, b, c),
                    vi::detail::exact_fma(a, b, c), vi::fma(a, b, c));
    }
}
