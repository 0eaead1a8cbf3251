// Numbers in single precision: lanes beside single ones, and these beside the C library. Prints what
// fails, returns 1.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <random>

#include "vibroimpact/numeric/floats.hpp"

namespace {

int failures = 0;

void check(bool holds, const char* statement, int line) {
    if (holds || ++failures > 20) return;
    std::fprintf(stderr, "floats_test.cpp:%d: not true: %s\n", line, statement);
}
#define CHECK(statement) check((statement), #statement, __LINE__)

using single = vi::floats<1>;

bool same(float x, float y) {
    return (std::isnan(x) && std::isnan(y)) || std::memcmp(&x, &y, sizeof x) == 0;
}
bool same(single x, single y) {
    return same(x.v, y.v);
}

std::mt19937 random_numbers(5);
float any_float() {
    auto bits = static_cast<unsigned>(random_numbers());
    if (random_numbers() % 4 != 0) bits = (bits & 0x807fffff) | (90 + random_numbers() % 75) << 23;
    float out;
    std::memcpy(&out, &bits, sizeof out);
    return out;
}

// Sums that cancel, ties, results that are subnormal or too large: as fmaf() of the C library.
void fma_has_one_rounding() {
    for (int i = 0; i < 300000; ++i) {
        const float a = any_float(), b = any_float();
        for (const float c : {any_float(), -(a * b), std::nextafterf(-(a * b), 1.0f), a}) {
            CHECK(same(fma(single::of(a), single::of(b), single::of(c)).v, std::fmaf(a, b, c)));
            CHECK(same(vi::detail::exact_fma(a, b, c), std::fmaf(a, b, c)));
        }
    }
}

template <int N>
vi::floats<N> drawn() {
    vi::floats<N> x{};
    for (int i = 0; i < N; ++i)
        set_lane(x, i, single::of(any_float()));
    return x;
}

template <int N>
void lanes_are_single_ones() {
    using L = vi::floats<N>;
    const auto a = drawn<N>(), b = drawn<N>();
    L c = drawn<N>();
    set_lane(c, 1, lane(b, 1));
    const auto below = a < b;
    const auto each = [&](const L& found, const auto& expected) {
        for (int i = 0; i < N; ++i)
            CHECK(same(lane(found, i), expected(lane(a, i), lane(b, i), lane(c, i))));
    };
    each(a + b, [](auto x, auto y, auto) { return x + y; });
    each(a - b, [](auto x, auto y, auto) { return x - y; });
    each(a * b, [](auto x, auto y, auto) { return x * y; });
    each(a / b, [](auto x, auto y, auto) { return x / y; });
    each(-a, [](auto x, auto, auto) { return -x; });
    each(0.1 * a, [](auto x, auto, auto) { return 0.1 * x; });
    each(fma(a, b, c), [](auto x, auto y, auto z) { return fma(x, y, z); });
    each(fnma(a, b, c), [](auto x, auto y, auto z) { return fnma(x, y, z); });
    each(abs(a), [](auto x, auto, auto) { return abs(x); });
    each(min(b, c), [](auto, auto y, auto z) { return min(y, z); });
    each(max(b, c), [](auto, auto y, auto z) { return max(y, z); });
    each(select(below, c, a), [](auto x, auto y, auto z) { return select(x < y, z, x); });
    each(select(b == c, a, b), [](auto x, auto y, auto z) { return select(y == z, x, y); });
    each(select(b >= c, a, b), [](auto x, auto y, auto z) { return select(y >= z, x, y); });
    each(select((b <= c) & !below, a, b),
         [](auto x, auto y, auto z) { return select((y <= z) & !(x < y), x, y); });
    each(select((b > c) | below, a, b),
         [](auto x, auto y, auto z) { return select((y > z) | (x < y), x, y); });
    each(only(below, a), [](auto x, auto y, auto) { return only(x < y, x); });
    each(plus_where(below, abs(a), b),
         [](auto x, auto y, auto) { return plus_where(x < y, abs(x), y); });
}

// Rounded as one number is, and found again in double, whichever pack they come from.
template <int N>
void packs_are_joined_and_halved() {
    vi::pack<N> a{}, b{};
    for (int i = 0; i < N; ++i) {
        set_lane(a, i, std::ldexp(1.0 + i / 7.0, i % 2 ? 3 : -130)); // some are subnormal
        set_lane(b, i, i % 2 ? 1e300 : 0.1 * i);
    }
    const auto both = joined(a, b);
    const auto small = abs(both) < vi::floats<2 * N>(1.0);
    for (int i = 0; i < N; ++i) {
        CHECK(same(lane(both, i), single(lane(a, i))));
        CHECK(same(lane(both, N + i), single(lane(b, i))));
        CHECK(lane(vi::half<0>(both), i) == vi::half<0>(single(lane(a, i))));
        CHECK(lane(vi::half<1>(both), i) == vi::half<0>(single(lane(b, i))));
        CHECK(lane(vi::half<0>(small), i) == (lane(a, i) < 1.0));
        CHECK(lane(vi::half<1>(small), i) == (lane(b, i) < 1.0));
    }
}

} // namespace

int main() {
    fma_has_one_rounding();
    for (int i = 0; i < 1000; ++i) {
        lanes_are_single_ones<4>();
        lanes_are_single_ones<8>();
        lanes_are_single_ones<16>();
    }
    packs_are_joined_and_halved<2>();
    packs_are_joined_and_halved<4>();
    packs_are_joined_and_halved<8>();
    return failures != 0;
}
