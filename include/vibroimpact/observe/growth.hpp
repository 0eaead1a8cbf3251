// Lyapunov exponents: growth of tangent vectors from event to event, saltation included.
//
// Method      A trajectory of jets carries W tangent vectors through flights, event times and jumps
//             (scalar/jet.hpp). After every event they are made orthonormal in index order,
//             Z = Q U, and go on as Q; the logarithms of U's diagonal are summed from the first
//             event in the window to the last:
//                 lambda_i = sum log U_ii / (t_last - t_first)                                  (1)
//             W = 1: the largest exponent. Tangents at events leave out the direction of the flow,
//             whose exponent is 0: a mechanism of n coordinates and L lines has 2 n + L - 1 others
//             (2 n - 1 without forcing).
// Assumes     tangents had time to turn before the window (ensemble.hpp: `aligning`)
// Accuracy    (1) tends to the exponents as 1 / window in periodic, 1 / sqrt(window) in chaotic
//             motion. Grazing has infinite derivatives.
// Fails       NaN: fewer than two events in the window, or a tangent that is no number (grazing).
//             -infinity from a vector on that has vanished: the motion forgets that direction, as
//             at rest on a stop.
// Reference   Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980) 9-30; Mueller, Chaos,
//             Solitons and Fractals 5 (1995) 1671-1681 (saltation)
#pragma once

#include "vibroimpact/run.hpp"
#include "vibroimpact/scalar/jet.hpp"

namespace vi {

template <int W>
struct growth {
    static constexpr double vanished = 0x1p-44; // what rounding leaves of length 1
    double settle = 0.0;                        // begin of the window
    int count = W;                              // vectors in use
    double sum[W] = {};
    double first = 0.0, last = 0.0;
    long events = 0; // in the window
    bool broken = false;

    template <class Shape>
    VI_HD void see(const event<jet<double, W>, Shape>& e, trajectory<jet<double, W>, Shape>& at,
                   const clock& now, int n, int contacts) {
        // completed chatter leaves parts that the rest on the stop, which follows, takes away
        if (e.what == status::horizon || e.what == status::undecided || e.what == status::chatter)
            return;
        const double time = now.time();
        const bool counted = time >= settle && events++ > 0;
        for (int k = 0; k < W && k < count; ++k)
            orthonormalise(at, k, n, contacts, counted);
        if (counted)
            last = time;
        else
            first = last = time;
    }

    VI_HD double exponent(int i) const {
        return !broken && last > first ? sum[i] / (last - first) : not_a_number();
    }

private:
    template <class Shape>
    VI_HD void orthonormalise(trajectory<jet<double, W>, Shape>& at, int k, int n, int contacts,
                              bool counted) {
        const double whole = sqrt(product(at, k, k, n));
        for (int j = 0; j < k; ++j)
            combine(at, k, j, 1.0, -product(at, j, k, n), n, contacts);
        const double length = sqrt(product(at, k, k, n));
        if (!(length < infinity())) broken = true;
        const bool gone = !(length > vanished * max(whole, 1.0));
        if (counted) sum[k] = sum[k] + (gone ? -infinity() : log(length));
        combine(at, k, k, 0.0, gone ? 0.0 : 1.0 / length, n, contacts);
    }

    template <class Shape>
    VI_HD static double product(const trajectory<jet<double, W>, Shape>& at, int j, int k, int n) {
        double sum = 0.0;
        for (int i = 0; i < n; ++i)
            sum = sum + at.y[i].d[j] * at.y[i].d[k];
        return sum;
    }

    // z_k becomes a z_k + b z_j.
    template <class Shape>
    VI_HD void combine(trajectory<jet<double, W>, Shape>& at, int k, int j, double a, double b,
                       int n, int contacts) {
        for (int i = 0; i < n; ++i)
            at.y[i].d[k] = a * at.y[i].d[k] + b * at.y[i].d[j];
        for (int i = 0; i < contacts; ++i)
            at.rate[i].d[k] = a * at.rate[i].d[k] + b * at.rate[i].d[j];
    }
};

namespace detail {

// Numbers in (-1, 1) that look random: generic directions, the same everywhere.
struct generic_numbers {
    unsigned long long state = 1;
    VI_HD double next() {
        state = state * 6364136223846793005ULL + 1442695040888963407ULL; // Knuth, MMIX
        return static_cast<double>(static_cast<long long>(state) >> 11) * 0x1p-52;
    }
};

} // namespace detail

// A trajectory with generic tangents.
template <int W, class Flow>
VI_HD inline trajectory<jet<double, W>, typename Flow::shape_type>
with_tangents(const hybrid<Flow>& system, const trajectory<double, typename Flow::shape_type>& from,
              int count) {
    trajectory<jet<double, W>, typename Flow::shape_type> out{};
    const int n = system.dimension();
    detail::generic_numbers numbers;
    out.mode = from.mode;
    out.held = from.held;
    for (int i = 0; i < n; ++i)
        out.y[i].v = from.y[i];
    for (int k = 0; k < W && k < count; ++k) // the first vectors are the same however many follow
        for (int i = 0; i < n; ++i)
            out.y[i].d[k] = numbers.next();
    for (int i = 0; i < system.contacts(); ++i) {
        out.touching[i] = from.touching[i];
        out.flat[i] = from.flat[i];
        out.rate[i] =
            with_value(-from.touching[i] * watch(system.modes[from.mode].guards[i], 1, out.y, n),
                       from.rate[i]);
    }
    return out;
}

} // namespace vi
