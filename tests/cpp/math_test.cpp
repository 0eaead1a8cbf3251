// Prints elementary functions of given numbers, as hexadecimal floats.
//
// Reads lines "function argument [argument]" and writes the result (two for sincos) of each. Checks
// on the way that every lane of packs of 2, 4, 8 gives the same bits, and that a jet and a counting
// scalar have the same value; returns 1 if not.
#include <array>
#include <cstdio>
#include <cstring>
#include <string>

#include "vibroimpact/numeric/counting.hpp"
#include "vibroimpact/numeric/jet.hpp"
#include "vibroimpact/numeric/math.hpp"
#include "vibroimpact/numeric/pack.hpp"

namespace {

struct tag {
    static inline vi::operation_counts counts;
};

template <class T>
struct outcome {
    T first{}, second{};
    bool known = true;
};

template <class T>
outcome<T> evaluate(const std::string& name, const T& a, const T& b) {
    // For double, which no argument-dependent lookup helps: the C library must not be found
    // instead.
    using vi::atan2, vi::exp, vi::log, vi::sincos, vi::sqrt;
    using vi::copysign, vi::floor, vi::nearbyint;
    if (name == "sincos") {
        const auto f = sincos(a);
        return {f.s, f.c};
    }
    if (name == "exp") return {exp(a)};
    if (name == "log") return {log(a)};
    if (name == "atan2") return {atan2(a, b)};
    if (name == "sqrt") return {sqrt(a)};
    if constexpr (vi::Real<T>) {
        if (name == "floor") return {floor(a)};
        if (name == "nearbyint") return {nearbyint(a)};
        if (name == "copysign") return {copysign(a, b)};
    }
    return {T(0.0), T(0.0), false};
}

// Equal bits; any NaN equals any other.
bool same(double x, double y) {
    return (x != x && y != y) || std::memcmp(&x, &y, sizeof x) == 0;
}

// The lanes hold different arguments: the given one, its negative, its half, ...
template <int N>
bool lanes_agree(const std::string& name, double a, double b) {
    const std::array<double, 8> factors{1.0, -1.0, 0.5, 2.0, -3.0, 1e-9, 1e9, 0.0};
    vi::pack<N> pa, pb;
    for (int i = 0; i < N; ++i) {
        set_lane(pa, i, a * factors[i]);
        set_lane(pb, i, b * factors[(i + i / 2) % 8]);
    }
    const auto packed = evaluate(name, pa, pb);
    for (int i = 0; i < N; ++i) {
        const auto scalar = evaluate(name, lane(pa, i), lane(pb, i));
        if (!same(lane(packed.first, i), scalar.first) ||
            !same(lane(packed.second, i), scalar.second))
            return false;
    }
    return true;
}

template <class T>
bool value_agrees(const std::string& name, double a, double b, const outcome<double>& expected) {
    const auto other = evaluate(name, T(a), T(b));
    const auto plain = [](const T& x) {
        if constexpr (vi::scalar_traits<T>::is_jet)
            return value(x);
        else
            return x.v;
    };
    return !other.known ||
           (same(plain(other.first), expected.first) && same(plain(other.second), expected.second));
}

bool agree(const std::string& name, double a, double b, const outcome<double>& expected) {
    return lanes_agree<2>(name, a, b) && lanes_agree<4>(name, a, b) && lanes_agree<8>(name, a, b) &&
           value_agrees<vi::counting<tag>>(name, a, b, expected) &&
           value_agrees<vi::jet<double, 2>>(name, a, b, expected);
}

} // namespace

int main() {
    char line[256], name[32];
    while (std::fgets(line, sizeof line, stdin)) {
        double a = 0.0, b = 0.0;
        if (std::sscanf(line, "%31s %la %la", name, &a, &b) < 2) return 2;
        const auto result = evaluate<double>(name, a, b);
        if (!result.known) return 2;
        if (!agree(name, a, b, result)) {
            std::fprintf(stderr, "scalars disagree: %s", line);
            return 1;
        }
        std::printf("%a %a\n", result.first, result.second);
    }
}
