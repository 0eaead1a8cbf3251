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
//             In blocks q and q' have units, so lengths are those of
//                 |z|^2 = sum_j (z_q^2 + h^2 z_q'^2) / l^2 + sum_lines (z_s^2 + z_c^2 / omega^2)  (2)
//             h the step of the flow, l a length that the machine sets in the unit of q: the farthest stop,
//             offset or response that a contact sees, else what a constant force moves in a step. Without
//             blocks y has no units (compile/coordinates.py), and all weights are 1.
//             With c contacts closed, motions have 2 n + L - 2 c coordinates: at the event that ends the
//             flight there are as many directions less one, and no more than remain after it. The vectors
//             beyond have vanished, whatever rounding leaves of them.                            (3)
//             R is a pack for trajectories in lanes: those that had an event are named by a mask.
// Assumes     tangents had time to turn before the window (ensemble.hpp: `aligning`)
// Accuracy    (1) tends to the exponents as 1 / window in periodic, 1 / sqrt(window) in chaotic
//             motion. Grazing has infinite derivatives.
//             A long flight turns all vectors into the direction that shrinks least, and those of forced
//             motion into the flow, which the event takes away: then they are made orthonormal on the
//             way (follow_tangents.hpp).
// Fails       NaN: fewer than two events in the window, or a tangent that is no number (grazing).
//             -infinity from a vector on that has vanished: the motion forgets that direction, as
//             at rest on a stop.
// Reference   Benettin, Galgani, Giorgilli, Strelcyn, Meccanica 15 (1980) 9-30; Mueller, Chaos,
//             Solitons and Fractals 5 (1995) 1671-1681 (saltation)
#pragma once

#include "vibroimpact/engine/run.hpp"
#include "vibroimpact/numeric/jet.hpp"

namespace vi {

// The weights of squares in (2).
template <class R, int D>
struct tangent_norm {
    vec<R, D> weights;
};

namespace detail {

// l of (2).
template <class Flow>
VI_HD inline double length_of_machine(const hybrid<Flow>& system) {
    const auto& flow = system.modes[0].flow;
    const auto& guards = system.modes[0].guards;
    const int lines = system.lines(), first_line = system.dimension() - 2 * lines;
    double length = 0.0;
    for (int i = 0; i < system.contacts(); ++i) {
        const auto& row = guards[i].rows[0];
        double seen = max(guards[i].reach, abs(guards[i].gains[0])), gain = 0.0;
        for (int j = 0; j < first_line; j += 2)
            gain = max(gain, max(abs(row[j]), abs(row[j + 1]) / flow.step));
        for (int l = 0; l < lines; ++l) {
            const double* wave = row.x + first_line + 2 * l;
            const double omega = 1.0 / sqrt(system.inverse_omega_squared[l]);
            seen = max(seen, max(abs(wave[0]), abs(wave[1]) * omega));
        }
        if (gain > 0.0) length = max(length, seen / gain);
    }
    for (int j = 0; !(length > 0.0) && j < system.oscillators(); ++j)
        length = max(length, abs(flow.a[j]) * (flow.step * flow.step));
    return length > 0.0 ? length : 1.0; // where nothing has a length, phases move nothing either
}

template <class Flow>
VI_HD inline int closed_in(const hybrid<Flow>& system, int mode) {
    int count = 0;
    for (int i = 0, code = system.codes[mode]; i < system.contacts(); ++i, code /= 3)
        count += code % 3 != 0;
    return count;
}

} // namespace detail

template <class Flow>
VI_HD inline tangent_norm<double, Flow::max_dimension> norm_of(const hybrid<Flow>& system) {
    tangent_norm<double, Flow::max_dimension> out{};
    const int n = system.dimension(), first_line = n - 2 * system.lines();
    for (int i = 0; i < n; ++i)
        out.weights[i] = 1.0;
    if constexpr (is_modal<Flow>) {
        const double length = detail::length_of_machine(system), step = system.modes[0].flow.step;
        for (int i = 0; i < first_line; i += 2) {
            out.weights[i] = 1.0 / (length * length);
            out.weights[i + 1] = (step / length) * (step / length);
        }
        for (int l = 0; l < system.lines(); ++l)
            out.weights[first_line + 2 * l + 1] = system.inverse_omega_squared[l];
    }
    return out;
}

template <int W, class R = double>
struct growth {
    static constexpr double vanished = 0x1p-44; // what rounding leaves of length 1
    static constexpr double parallel = 0x1p-24; // what is shorter has lost half of its digits
    R settle = R(0.0);                          // begin of the window
    int count = W;                              // vectors in use
    R sum[W] = {};
    R first = R(0.0), last = R(0.0);
    R events = R(0.0); // in the window
    mask_t<R> broken{};
    R states = R(infinity()); // coordinates of the motion after the last event, by (3)
    mask_t<R> lost{}; // a vector that was not 0 is now `parallel` to those before it, or as short

    template <class Flow>
    VI_HD void see(const event<jet<R, W>, typename Flow::shape_type>& e,
                   trajectory<jet<R, W>, typename Flow::shape_type>& at, const clock& now,
                   const hybrid<Flow>& system, const tangent_norm<R, Flow::max_dimension>& norm) {
        // completed chatter leaves parts that the rest on the stop, which follows, takes away
        if (e.what == status::chatter || !moves_on(e.what)) return;
        const int n = system.dimension(), closed = detail::closed_in(system, at.mode);
        const double after = n - system.lines() - 2 * closed,
                     room = min(states - 1.0, after); // (3)
        states = after;
        see(true, at, now.time(), norm, n, system.contacts(), room);
    }

    // After an event at that time, in every lane where it `happened`: with so many directions left.
    template <class Shape>
    VI_HD void see(const mask_t<R>& happened, trajectory<jet<R, W>, Shape>& at, const R& time,
                   const tangent_norm<R, Shape::max_dimension>& norm, int n, int contacts,
                   double room = infinity()) {
        const mask_t<R> inside = happened & (time >= settle), counted = inside & (events > 0.0);
        events = events + select(inside, R(1.0), R(0.0));
        for (int k = 0; k < W && k < count; ++k)
            orthonormalise(at, k, norm, n, contacts, happened, counted, k < room);
        last = select(happened, time, last);
        first = select(happened & !counted, time, first);
    }

    // Lanes in which a flight has cost the first vector half of its digits.
    template <class Shape>
    VI_HD mask_t<R> faded(const mask_t<R>& happened, const trajectory<jet<R, W>, Shape>& at,
                          const tangent_norm<R, Shape::max_dimension>& norm, int n) const {
        const R length = sqrt(product(at, 0, 0, norm, n));
        return happened & (length > 0.0) & (length <= parallel);
    }

    VI_HD double exponent(int i) const {
        return !broken && last > first ? sum[i] / (last - first) : not_a_number();
    }

private:
    template <class Shape>
    VI_HD void orthonormalise(trajectory<jet<R, W>, Shape>& at, int k,
                              const tangent_norm<R, Shape::max_dimension>& norm, int n,
                              int contacts, const mask_t<R>& happened, const mask_t<R>& counted,
                              bool exists) {
        const R whole = sqrt(product(at, k, k, norm, n));
        for (int j = 0; j < k; ++j)
            combine(at, k, j, R(1.0), -product(at, j, k, norm, n), n, contacts, happened);
        const R length = exists ? sqrt(product(at, k, k, norm, n)) : R(0.0);
        broken = broken | (happened & !(length < infinity()));
        if (exists)
            lost = lost | (happened & (whole > 0.0) & (length <= parallel * max(whole, R(1.0))));
        const mask_t<R> gone = !(length > vanished * max(whole, R(1.0)));
        if (any(counted))
            sum[k] = select(counted, sum[k] + select(gone, R(-infinity()), log(length)), sum[k]);
        combine(at, k, k, R(0.0), select(gone, R(0.0), 1.0 / length), n, contacts, happened);
    }

    template <class Shape>
    VI_HD static R product(const trajectory<jet<R, W>, Shape>& at, int j, int k,
                           const tangent_norm<R, Shape::max_dimension>& norm, int n) {
        R sum = R(0.0);
        for (int i = 0; i < n; ++i)
            sum = sum + norm.weights[i] * at.y[i].d[j] * at.y[i].d[k];
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

// The growth and the weights of one lane, and back.
template <int W, class R>
VI_HD inline growth<W> lane(const growth<W, R>& all, int i) {
    growth<W> one{lane(all.settle, i), all.count};
    for (int k = 0; k < W; ++k)
        one.sum[k] = lane(all.sum[k], i);
    one.first = lane(all.first, i);
    one.last = lane(all.last, i);
    one.events = lane(all.events, i);
    one.states = lane(all.states, i);
    one.broken = lane(all.broken, i);
    return one;
}
template <class R, int D>
VI_HD inline tangent_norm<double, D> lane(const tangent_norm<R, D>& all, int i) {
    tangent_norm<double, D> one;
    for (int j = 0; j < D; ++j)
        one.weights[j] = lane(all.weights[j], i);
    return one;
}
template <class R, int D>
VI_HD inline void set_lane(tangent_norm<R, D>& all, int i, const tangent_norm<double, D>& one) {
    for (int j = 0; j < D; ++j)
        set_lane(all.weights[j], i, one.weights[j]);
}
template <int W, class R>
VI_HD inline void set_lane(growth<W, R>& all, int i, const growth<W>& one) {
    set_lane(all.settle, i, one.settle);
    for (int k = 0; k < W; ++k)
        set_lane(all.sum[k], i, one.sum[k]);
    set_lane(all.first, i, one.first);
    set_lane(all.last, i, one.last);
    set_lane(all.events, i, one.events);
    set_lane(all.states, i, one.states);
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

// A trajectory with generic tangents, in the sizes of (2).
template <int W, class Flow>
VI_HD inline trajectory<jet<double, W>, typename Flow::shape_type>
with_tangents(const hybrid<Flow>& system, const trajectory<double, typename Flow::shape_type>& from,
              int count) {
    trajectory<jet<double, W>, typename Flow::shape_type> out{};
    const int n = system.dimension();
    const auto norm = norm_of(system);
    detail::generic_numbers numbers;
    out.mode = from.mode;
    out.held = from.held;
    out.elements = from.elements;
    for (int i = 0; i < n; ++i)
        out.y[i].v = from.y[i];
    for (int k = 0; k < W && k < count; ++k) // the first vectors are the same however many follow
        for (int i = 0; i < n; ++i)
            out.y[i].d[k] = numbers.next() / sqrt(norm.weights[i]);
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
