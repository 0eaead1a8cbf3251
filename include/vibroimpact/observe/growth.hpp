// Lyapunov exponents: growth of tangent vectors from event to event, saltation included.
//
// Method      A trajectory of jets carries W tangent vectors through flights, event times and jumps
//             (numeric/jet.hpp). After every event they are made orthonormal in index order,
//             Z = Q U, and go on as Q; the logarithms of U's diagonal are summed from the first
//             event in the window to the last:
//                 lambda_i = sum log U_ii / (t_last - t_first)                                  (1)
//             W = 1: the largest exponent. Tangents at events leave out the direction of the flow,
//             whose exponent is 0: a mechanism of n coordinates and L lines has 2 n + L - 1 others
//             (2 n - 1 without forcing).
//             R is a pack for trajectories in lanes: those that had an event are named by a mask.
// Assumes     tangents had time to turn before the window (ensemble.hpp: `aligning`)
// Accuracy    (1) tends to the exponents as 1 / window in periodic, 1 / sqrt(window) in chaotic
//             motion. Grazing has infinite derivatives.
//             A long flight turns all vectors into the direction that shrinks least; one by itself
//             loses no digits so, several are made orthonormal on the way (ensemble.hpp).
// Fails       NaN: fewer than two events in the window, or a tangent that is no number (grazing).
//             -infinity from a vector on that has vanished: the motion forgets that direction, as
//             at rest on a stop.
// Reference   Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980) 9-30; Mueller, Chaos,
//             Solitons and Fractals 5 (1995) 1671-1681 (saltation)
#pragma once

#include "vibroimpact/engine/run.hpp"
#include "vibroimpact/numeric/jet.hpp"

namespace vi {

template <int W, class R = double>
struct growth {
    static constexpr double vanished = 0x1p-44; // what rounding leaves of length 1
    static constexpr double parallel = 0x1p-24; // shorter, a flight has cost half of the digits
    R settle = R(0.0);                          // begin of the window
    int count = W;                              // vectors in use
    R sum[W] = {};
    R first = R(0.0), last = R(0.0);
    R events = R(0.0); // in the window
    mask_t<R> broken{};
    mask_t<R> lost{}; // a vector that was not 0 is now `parallel` to those before it

    template <class Shape>
    VI_HD void see(const event<jet<R, W>, Shape>& e, trajectory<jet<R, W>, Shape>& at,
                   const clock& now, int n, int contacts) {
        // completed chatter leaves parts that the rest on the stop, which follows, takes away
        if (e.what == status::chatter || !moves_on(e.what)) return;
        see(true, at, now.time(), n, contacts);
    }

    // After an event at that time, in every lane where it `happened`.
    template <class Shape>
    VI_HD void see(const mask_t<R>& happened, trajectory<jet<R, W>, Shape>& at, const R& time,
                   int n, int contacts) {
        const mask_t<R> inside = happened & (time >= settle), counted = inside & (events > 0.0);
        events = events + select(inside, R(1.0), R(0.0));
        for (int k = 0; k < W && k < count; ++k)
            orthonormalise(at, k, n, contacts, happened, counted);
        last = select(happened, time, last);
        first = select(happened & !counted, time, first);
    }

    VI_HD double exponent(int i) const {
        return !broken && last > first ? sum[i] / (last - first) : not_a_number();
    }

private:
    template <class Shape>
    VI_HD void orthonormalise(trajectory<jet<R, W>, Shape>& at, int k, int n, int contacts,
                              const mask_t<R>& happened, const mask_t<R>& counted) {
        const R whole = sqrt(product(at, k, k, n));
        for (int j = 0; j < k; ++j)
            combine(at, k, j, R(1.0), -product(at, j, k, n), n, contacts, happened);
        const R length = sqrt(product(at, k, k, n));
        broken = broken | (happened & !(length < infinity()));
        if (k > 0)
            lost = lost | (happened & (whole > 0.0) & (length <= parallel * max(whole, R(1.0))));
        const mask_t<R> gone = !(length > vanished * max(whole, R(1.0)));
        if (any(counted))
            sum[k] = select(counted, sum[k] + select(gone, R(-infinity()), log(length)), sum[k]);
        combine(at, k, k, R(0.0), select(gone, R(0.0), 1.0 / length), n, contacts, happened);
    }

    template <class Shape>
    VI_HD static R product(const trajectory<jet<R, W>, Shape>& at, int j, int k, int n) {
        R sum = R(0.0);
        for (int i = 0; i < n; ++i)
            sum = sum + at.y[i].d[j] * at.y[i].d[k];
        return sum;
    }

    // z_k becomes a z_k + b z_j.
    template <class Shape>
    VI_HD void combine(trajectory<jet<R, W>, Shape>& at, int k, int j, const R& a, const R& b,
                       int n, int contacts, const mask_t<R>& happened) {
        const auto turn = [&](jet<R, W>& x) {
            x.d[k] = select(happened, a * x.d[k] + b * x.d[j], x.d[k]);
        };
        for (int i = 0; i < n; ++i)
            turn(at.y[i]);
        for (int i = 0; i < contacts; ++i)
            turn(at.rate[i]);
    }
};

// The growth of one lane, and back.
template <int W, class R>
VI_HD inline growth<W> lane(const growth<W, R>& all, int i) {
    growth<W> one{lane(all.settle, i), all.count};
    for (int k = 0; k < W; ++k)
        one.sum[k] = lane(all.sum[k], i);
    one.first = lane(all.first, i);
    one.last = lane(all.last, i);
    one.events = lane(all.events, i);
    one.broken = lane(all.broken, i);
    return one;
}
template <int W, class R>
VI_HD inline void set_lane(growth<W, R>& all, int i, const growth<W>& one) {
    set_lane(all.settle, i, one.settle);
    for (int k = 0; k < W; ++k)
        set_lane(all.sum[k], i, one.sum[k]);
    set_lane(all.first, i, one.first);
    set_lane(all.last, i, one.last);
    set_lane(all.events, i, one.events);
    set_lane(all.broken, i, one.broken);
}

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
    out.elements = from.elements;
    for (int i = 0; i < n; ++i)
        out.y[i].v = from.y[i];
    for (int k = 0; k < W && k < count; ++k) // the first vectors are the same however many follow
        for (int i = 0; i < n; ++i)
            out.y[i].d[k] = numbers.next();
    for (int i = 0; i < system.contacts(); ++i) {
        out.touching[i] = from.touching[i];
        out.flat[i] = from.flat[i];
        out.rate[i] = with_value(-from.touching[i] *
                                     guard_value(system.modes[from.mode].guards[i], 1, out.y, n),
                                 from.rate[i]);
    }
    return out;
}

} // namespace vi
