// A flight to its first event, proved.
//
// Method      The march is step by step. In every step each gap function is a Taylor
//             polynomial (18 derivatives, rows of the guard times y), and its first root is found or
//             excluded by first_root.hpp. The earliest over all guards ends the flight. Where it is due, within
//             rounding, only beyond the end of the step, guards are examined up to there, too.
//             Where nothing that moves can reach a stop (search/reach.hpp), 32 or 1024 steps are taken
//             at once; the states are those of the march, but where 2^15 or more are. Flows without
//             blocks take strides of 2^n steps (system/stride.hpp). After a while it is asked whether
//             anything can happen at all (search/silence.hpp): where not, the horizon is reached at once.
//             A micro-bounce, back on its stop long before the first step is over, is searched for up to
//             a quarter beyond its return alone, with polynomials of lower order, at all guards. A root
//             there ends the flight; without one, or where that is not decided, it is marched.
//             A flight that may pause does so as soon as it is off all stops, and any that is off
//             them after a while, so that the caller may decide whether to continue.
// Accuracy    eps = 2^-53 (16 + 4 applications) (sum of the terms of u + |limit|): what recurrences
//             and sums can have added since the flight began, rounds before `start` counted in
//             `earlier`. Outside eps no contact is missed and none invented; inside
//             it the flight ends as grazing.
//             A flight that leaves a stop starts from exact zeros, so micro-bounces keep their
//             relative accuracy down to the smallest speeds.
// Assumes     a state that has not diverged
// Fails       horizon: no event up to the given time; paused, searching: none yet; undecided: see
//             first_root.hpp; steps: none in 2^51 steps, or after 2^22 that were examined in one leg;
//             diverged: see has_diverged
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/search/first_root.hpp"
#include "vibroimpact/search/silence.hpp"
#include "vibroimpact/system/refreshed_march.hpp"

namespace vi {

inline constexpr double most_steps = 0x1p51;  // of one flight: the time is known to a step's part
inline constexpr int steps_in_a_row = 4096;   // leaps and strides are one: some milliseconds
inline constexpr int most_in_a_row = 1 << 22; // while it is on a stop that it started on
inline constexpr int longer_leap = 5; // doublings: then the states are not those of the march

enum class flight_end { contact, grazing, horizon, paused, searching, undecided, steps, diverged };

// The states that elements are in, as a code, and where the present flight starts on a limit of watch j: zeros[j] is
// then how many derivatives of that margin, from its value on, are zero, with the sign of the side;
// most_zeros + 1 where no derivative leads away. Values lie on the limit but for rounding, the offset.
inline constexpr int most_zeros = 6;
inline constexpr int no_states = -1; // code of a start, whose states are still to be decided
template <int Watches>
struct element_states {
    int code = 0;
    bool settled = false; // decided since the last event
    int due = 0; // a watch that is crossed at once: its number and 1, with the sign of the side
    double size = 0.0; // largest coordinate where the present flight began, which rounding is of
    int zeros[Watches] = {};
    double offset[Watches] = {};

    // Whether no derivative leads away from the limit of a watch.
    VI_HD constexpr bool stays_on(int j) const {
        return zeros[j] > most_zeros || zeros[j] < -most_zeros;
    }
};
template <>
struct element_states<0> {};

// Position of a trajectory: coordinates in a mode, and the stops that it is about to leave.
template <class T, class Shape>
struct trajectory {
    using real = real_t<T>;
    vec<T, Shape::max_dimension> y;
    int mode = 0;
    int held = 0;                            // code of the contacts that were closed last
    vec<real, Shape::max_contacts> touching; // +1, -1: on that stop, 0: not
    vec<T, Shape::max_contacts> rate; // gap rate of a touching contact, exact as the law gave it
    // 1 where the gap's second derivative is zero exactly; where a contact is closed without a force,
    // minus the size of the terms of that force.
    vec<real, Shape::max_contacts> flat;
    [[no_unique_address]] element_states<Shape::max_watches> elements;
};

template <class T, class Shape>
struct landing {
    flight_end end;
    int contact, side;
    T duration;
    T rate;                         // gap rate at arrival
    vec<T, Shape::max_dimension> y; // in the coordinates of the flight's mode
    double applications = 0.0;      // of propagators on the way
    int examined = 0;               // steps, leaps and strides
};

// Beyond this size seven derivatives at the fastest rate that is accepted, 2^108, might overflow. It is counted in the
// machine's unit of length: that of y where there are no blocks, else what limits, lines and forces say of u.
inline constexpr double largest_state = 0x1p256;

// Whether nothing can be decided any more: y is that large, or no number, or the clearance of a contact
// is hardly more than the rounding of its u.
template <class Mode, class T, int D>
VI_HD inline bool has_diverged(const Mode& m, const vec<T, D>& y) {
    constexpr bool blocks = is_modal<typename Mode::flow_type>;
    for (int i = 0; i < m.flow.dimension(); ++i)
        if (!(abs(plain(y[i])) < (blocks ? infinity() : largest_state))) return true;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const bool narrow = g.upper - g.lower < infinity();
        if (!blocks && !narrow) continue;
        const double terms = plain(magnitude(g, 0, y, m.flow));
        if (blocks && g.own_size > 0.0 && !(terms < largest_state * g.own_size)) return true;
        if (narrow && !(16.0 * rounding_at(g.reach, terms) < g.upper - g.lower)) return true;
    }
    return false;
}

namespace detail {

template <int N>
struct earliest {
    finding what = finding::none;
    double s = 0.0, latest = infinity(); // in units of time; what is due with it is so by `latest`
    int contact = -1, side = 0;
    taylor<N> gap{};
};

// u and its derivatives in units of time, values only.
template <int N, class T, int Dimension, int Orders, class Flow>
VI_HD inline taylor<N> derivatives(const guard<double, Dimension, Orders>& g,
                                   const vec<T, Dimension>& y, const Flow& flow) {
    const int n = flow.dimension();
    const auto z = plain_state(y, n);
    const double unit = unit_of_time(flow.step);
    double power = 1.0;
    taylor<N> u{};
    for (int m = 0; m <= N; ++m) {
        u.d[m] = power * guard_value(g, m, z, n);
        if (m < plain_orders) power = power * unit;
    }
    return u;
}

template <int N>
VI_HD inline taylor<N> gap_on(int side, double limit, const taylor<N>& u) {
    taylor<N> g{};
    for (int m = 0; m <= N; ++m)
        g.d[m] = side * -u.d[m];
    g.d[0] = side * (limit - u.d[0]);
    return g;
}

// Puts in what is exact of a gap that its flight has not left yet: zeros. In the first step also the rate.
template <int N, class Guard, class T, class Shape, class Flow>
VI_HD inline void keep_exact(taylor<N>& g, const Guard& guard, int i,
                             const vec<T, Shape::max_dimension>& y,
                             const trajectory<T, Shape>& start, const Flow& flow, bool first) {
    const double unit = unit_of_time(flow.step);
    g.d[0] = 0.0;
    if (first) {
        g.d[1] = unit * plain(start.rate[i]);
        if (start.flat[i] != 0.0) g.d[2] = 0.0;
        return;
    }
    double power = 64.0 * unit_roundoff;
    for (int m = 1; m <= 3; ++m) {
        power = power * unit;
        if (abs(g.d[m]) <= power * plain(magnitude(guard, m, y, flow))) g.d[m] = 0.0;
    }
}

// Of guards that are due within rounding of one another the one with the smallest number is taken, so that no last
// bit decides. A root may wait for `late`, in which its g falls by twice the rounding of u at most, g' late and
// g'' late^2 / 2: what is due with the one that is taken touches then (transition.hpp), and so its `rounding` is eps,
// or what counts as touching if that is less; zero where g is exact.
template <int N>
VI_HD inline void take_first(const window_verdict& v, int number, int side, const taylor<N>& g,
                             double rounding, earliest<N>& first) {
    if (v.what == finding::none) return;
    double late = 0.0;
    if (v.what == finding::root) {
        const double speed = abs(evaluate(g, 1, v.s)), bend = abs(evaluate(g, 2, v.s));
        const double pace = max(speed, sqrt(0.5 * rounding * bend));
        if (pace > 0.0) late = rounding / pace;
    }
    const double latest = min(first.latest, v.s + late);
    if (first.what == finding::none || first.s > latest)
        first = {v.what, v.s, latest, number, side, g};
    else
        first.latest = latest;
}

// Whether a guard of a flow without blocks need not be looked at: the verdict would be none.
template <class Guard, class T, int D, class Flow>
VI_HD inline bool is_out_of_reach(const Guard& g, const vec<T, D>& y, double span,
                                  double applications, const Flow& flow) {
    if constexpr (is_modal<Flow>)
        return false;
    else
        return applications < most_out_of_reach && stays_out_of_reach(g, y, span, flow);
}

// `still` says whether the flight has not left the stop that it started on.
template <int N, class T, class Mode, class Shape>
VI_HD inline void inspect_contact(const Mode& m, int i, const vec<T, Shape::max_dimension>& y,
                                  const trajectory<T, Shape>& start, bool& still,
                                  double applications, int earlier, double span,
                                  earliest<N>& first) {
    const auto& guard = m.guards[i];
    if (!guard.closed && is_out_of_reach(guard, y, span, applications + earlier, m.flow)) {
        still = still && (start.touching[i] == 0.0 || applications == 0);
        return;
    }
    const taylor<N> u = derivatives<N>(guard, y, m.flow);
    const double units = span / unit_of_time(m.flow.step), farthest = change_bound(u, units);
    const double terms = max(plain(magnitude(guard, 0, y, m.flow)), -plain(start.flat[i]));
    for (int side = -1; side <= 1; side += 2) {
        const double limit = side > 0 ? guard.upper : guard.lower;
        if (!(abs(limit) < 0x1p1000)) continue;
        const double eps = rounding_after(applications + earlier, terms + abs(limit));
        const double gap = side * (limit - u.d[0]);
        bool leaving = still && start.touching[i] == side && !guard.closed;
        if (leaving && applications > 0) still = leaving = abs(gap) <= eps;
        if (gap > farthest + eps) continue; // not within reach of this step
        taylor<N> g = gap_on(side, limit, u);
        if (leaving) keep_exact(g, guard, i, y, start, m.flow, applications == 0);
        const bool no_force = start.flat[i] > 0.0 || (start.flat[i] < 0.0 && abs(g.d[0]) <= eps);
        if (guard.closed && applications == 0 && no_force) g.d[0] = 0.0;
        if (guard.closed) g.d[0] = g.d[0] + 4.0 * eps; // released once the force is surely negative
        const double rounding = leaving ? 0.0 : min(eps, rounding_at(limit, terms));
        take_first(first_root(g, units, eps, leaving), i, side, g, rounding, first);
    }
}

// Inspects watch j of a mode, as above a contact; its number follows those of the contacts.
template <int N, class T, class Mode, class Shape>
VI_HD inline void inspect_watch(const Mode& m, int j, const vec<T, Shape::max_dimension>& y,
                                const trajectory<T, Shape>& start, bool& still, double applications,
                                int earlier, double span, earliest<N>& first) {
    const auto& guard = m.watched.at[j].row;
    if (m.watched.at[j].held) return;
    if (is_out_of_reach(guard, y, span, applications + earlier, m.flow)) {
        still = still && (start.elements.zeros[j] == 0 || applications == 0);
        return;
    }
    const taylor<N> u = derivatives<N>(guard, y, m.flow);
    const double units = span / unit_of_time(m.flow.step), farthest = change_bound(u, units);
    const double terms = plain(magnitude(guard, 0, y, m.flow));
    const int zeros = start.elements.zeros[j];
    for (int side = -1; side <= 1; side += 2) {
        const double limit = side > 0 ? guard.upper : guard.lower;
        if (!(abs(limit) < 0x1p1000)) continue;
        const double eps = rounding_after(applications + earlier, terms + abs(limit));
        const bool here = zeros * side > 0;
        if (still && start.elements.stays_on(j) && !here) continue; // the other is at its limit
        taylor<N> g = gap_on(side, limit, u);
        bool leaving = still && here;
        const double moved = leaving ? g.d[0] - start.elements.offset[j] : 0.0;
        if (leaving && applications > 0) still = leaving = abs(moved) <= eps;
        if (leaving) g.d[0] = moved;           // once it has left, the limit is where it is
        if (g.d[0] > farthest + eps) continue; // not within reach of this step
        if (leaving && start.elements.stays_on(j)) continue; // nothing moves it
        for (int k = 0; leaving && applications == 0 && k < zeros * side; ++k)
            g.d[k] = 0.0;
        if (leaving) g.d[0] = 0.0;
        const double rounding = leaving ? 0.0 : min(eps, rounding_at(limit, terms));
        take_first(first_root(g, units, eps, leaving), m.flow.contacts() + j, side, g, rounding,
                   first);
    }
}

template <class Mode, class T, int D>
VI_HD inline bool all_stay_clear(const Mode& m, const vec<T, D>& y, double time) {
    const auto z = plain_state(y, m.flow.dimension());
    for (int i = 0; i < m.flow.contacts(); ++i)
        if (!stays_clear(m.guards[i], m.flow, z, time)) return false;
    return true;
}

// Leap, as far as all is clear; false where it is not. What is left to the horizon is marched.
template <class Mode, class March>
VI_HD inline bool leap(const Mode& m, double horizon, March& at) {
    const auto& flow = m.flow;
    const auto may = [&](double steps) {
        return steps > 0.0 && at.steps() + steps < most_steps &&
               (at.steps() + steps) * flow.step < horizon &&
               all_stay_clear(m, at.y, steps * flow.step);
    };
    const double far = at.far_leap_ahead();
    int doublings = longer_leap;
    while (may(two_to(doublings) * far))
        ++doublings;
    if (doublings > longer_leap)
        at.leap_farther(flow, doublings - 1);
    else if (may(far))
        at.leap_far(flow);
    else if (may(at.leap_ahead()))
        at.leap(flow);
    else
        return false;
    return true;
}

// Whether all stops on which the flight started are left behind, beyond any rounding.
template <class Mode, class T, class Shape>
VI_HD inline bool has_left(const Mode& m, const vec<T, Shape::max_dimension>& y,
                           const trajectory<T, Shape>& start) {
    const auto z = plain_state(y, m.flow.dimension());
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const double side = plain(start.touching[i]);
        const auto& g = m.guards[i];
        if (side == 0.0 || g.closed || keeps_gap(m, i)) continue;
        const double limit = side > 0.0 ? g.upper : g.lower;
        const double gap = side * (limit - guard_value(g, 0, z, m.flow.dimension()));
        if (!(gap > proof_margin * (magnitude(g, 0, z, m.flow) + abs(limit)))) return false;
    }
    if constexpr (Shape::max_watches > 0)
        for (int j = 0; j < m.watched.count; ++j) {
            const auto& g = m.watched.at[j].row;
            const int zeros = start.elements.zeros[j];
            if (zeros == 0 || start.elements.stays_on(j)) continue;
            const double u = guard_value(g, 0, z, m.flow.dimension());
            const double gap = zeros > 0 ? g.upper - u : u - g.lower;
            if (!(gap > proof_margin * magnitude(g, 0, z, m.flow))) return false;
        }
    return true;
}

VI_HD inline flight_end end_of(finding what) {
    return what == finding::root      ? flight_end::contact
           : what == finding::grazing ? flight_end::grazing
                                      : flight_end::undecided;
}

} // namespace detail

// Give x another value and keep its derivatives, which may be infinite.
template <class T>
VI_HD inline T with_value(const T& x, const real_t<T>& v) {
    T out = x;
    if constexpr (scalar_traits<T>::is_jet)
        out.v = v;
    else
        out = v;
    return out;
}

namespace detail {

// Landing of a flight that has come to y some time after its start.
template <int N, class T, class Mode, class Shape>
VI_CALL landing<T, Shape> land_on(const Mode& m, const earliest<N>& first,
                                  const vec<T, Shape::max_dimension>& y, double passed) {
    const auto& guard = guard_of(m, first.contact);
    const int n = m.flow.dimension();
    const double unit = unit_of_time(m.flow.step), s = first.s * unit;
    landing<T, Shape> out{end_of(first.what), first.contact, first.side,
                          T(passed + s),      T(0.0),        m.flow.template short_flight<N>(y, s)};
    const T slope = -first.side * guard_value(guard, 1, out.y, n);
    out.rate = with_value(slope, evaluate(first.gap, 1, first.s) / unit);
    if (out.end != flight_end::contact) return out;
    if constexpr (scalar_traits<T>::is_jet) { // dt = -dg / g', value zero
        const T gap = -first.side * guard_value(guard, 0, out.y, n);
        const T shift = with_value(-gap / plain(out.rate), 0.0);
        out.y = m.flow.template short_flight<3>(out.y, shift);
        out.rate = with_value(-first.side * guard_value(guard, 1, out.y, n), plain(out.rate));
        out.duration = out.duration + shift;
    }
    return out;
}

// Micro-bounces up to so long, in steps, are found by polynomials of lower order: of the terms of u
// (7/10 / 4)^13 / 13! < 2^-64 is cut off, and of the height of a bounce, w its fastest rate and a its bend,
// (7/10 / 4)^11 8 / 13! or (7/10 / 1024)^5 8 / 7!, both below 2^-57, times w^2 u / a.
inline constexpr double longest_bounce = 0.25, shortest_bounce = 1.0 / 1024;
inline constexpr int bounce_order = 12, short_bounce_order = 6;

// A quarter beyond the first return to a stop that is being left.
template <class T, class Mode, class Shape>
VI_HD inline double end_of_bounce(const Mode& m, const trajectory<T, Shape>& start) {
    double end = infinity();
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const double side = plain(start.touching[i]);
        if (side == 0.0 || m.guards[i].closed) continue;
        const T bend = guard_value(m.guards[i], 2, start.y, m.flow.dimension());
        end = min(end, beyond_bounce(plain(start.rate[i]), -side * plain(bend)));
    }
    return end;
}

template <int N, class T, class Mode, class Shape>
VI_HD inline bool find_bounce_end(const Mode& m, const trajectory<T, Shape>& start, double span,
                                  int earlier, landing<T, Shape>& out) {
    earliest<N> first;
    for (int i = 0; i < m.flow.contacts(); ++i) {
        bool still = true;
        inspect_contact(m, i, start.y, start, still, 0, earlier, span, first);
    }
    if constexpr (Shape::max_watches > 0)
        for (int j = 0; j < m.watched.count; ++j) {
            bool still = true;
            inspect_watch(m, j, start.y, start, still, 0, earlier, span, first);
        }
    if (first.what != finding::root) return false;
    out = land_on<N, T, Mode, Shape>(m, first, start.y, 0.0);
    return true;
}

// Whether a flight that may be back by `soon` meets a stop by then; `out` is where.
template <class T, class Mode, class Shape>
VI_HD inline bool micro_bounce(const Mode& m, const trajectory<T, Shape>& start, double soon,
                               int earlier, landing<T, Shape>& out) {
    return soon <= shortest_bounce * m.flow.step
               ? find_bounce_end<short_bounce_order>(m, start, soon, earlier, out)
               : find_bounce_end<bounce_order>(m, start, soon, earlier, out);
}

} // namespace detail

template <class T, class Mode, class Shape>
VI_CALL landing<T, Shape> certified_flight(const Mode& m, const trajectory<T, Shape>& start,
                                           double horizon, bool may_pause, int earlier) {
    using namespace detail;
    const auto& flow = m.flow;
    landing<T, Shape> landed;
    const double soon = end_of_bounce(m, start);
    if (soon <= min(longest_bounce * flow.step, horizon) &&
        micro_bounce(m, start, soon, earlier, landed))
        return landed;
    bool still[Shape::max_contacts + Shape::max_watches];
    for (bool& s : still)
        s = true;
    const auto examine = [&](auto& first, const auto& y, double applications, double span) {
        for (int i = 0; i < flow.contacts(); ++i)
            inspect_contact(m, i, y, start, still[i], applications, earlier, span, first);
        if constexpr (Shape::max_watches > 0)
            for (int j = 0; j < m.watched.count; ++j)
                inspect_watch(m, j, y, start, still[Shape::max_contacts + j], applications, earlier,
                              span, first);
    };
    refreshed_march<T, typename Mode::flow_type> at(start.y);
    earliest<taylor_order> first;
    int examined = 0;
    const auto stop = [&](flight_end why, double s) -> landing<T, Shape> {
        return {why,     -1, 0, T(at.steps() * flow.step + s), T(0.0), at.y, at.applications(),
                examined};
    };
    const auto skips = [&](int i) {
        if constexpr (Shape::max_watches > 0)
            if (const int j = i - flow.contacts(); j >= 0)
                return m.watched.at[j].held ||
                       (still[Shape::max_contacts + j] && start.elements.stays_on(j));
        return false;
    };
    const auto leave = [&] { // all guards that a stride has looked at are off their limits
        for (int i = 0; i < flow.contacts(); ++i)
            still[i] = false;
        for (int j = 0; j < m.watched.count; ++j)
            still[Shape::max_contacts + j] = skips(flow.contacts() + j);
    };
    int waiting = 0, wait = 0, asked = steps_in_a_row; // until a stride is tried, or silence proved
    for (;; ++examined, at.advance(flow)) {
        if (examined >= asked && !may_pause && horizon < infinity()) {
            asked = examined + examined;
            if (is_silent(m, at.y, start)) {
                const double s = max(horizon - at.steps() * flow.step, 0.0);
                auto out = stop(flight_end::horizon, s);
                out.y = flow.flight(at.y, s);
                return out;
            }
        }
        const bool off = at.steps() > 0.0 && (may_pause || examined >= steps_in_a_row) &&
                         has_left(m, at.y, start);
        if (off) return stop(may_pause ? flight_end::paused : flight_end::searching, 0.0);
        if (at.steps() > 0.0 && has_diverged(m, at.y)) return stop(flight_end::diverged, 0.0);
        if (!(at.steps() < most_steps && examined < most_in_a_row))
            return stop(flight_end::steps, 0.0);
        if constexpr (is_modal<typename Mode::flow_type>) {
            while (leap(m, horizon, at))
                ++examined;
        } else if (flow.growth < infinity() && waiting-- == 0) {
            for (; examined < steps_in_a_row && stride(m, horizon, earlier, skips, at);
                 ++examined) {
                wait = 0;
                leave();
                if (has_diverged(m, at.y)) return stop(flight_end::diverged, 0.0);
            }
            wait = 2 * wait + 1 < most_waiting ? 2 * wait + 1 : most_waiting;
            waiting = wait;
        }
        const double left = horizon - at.steps() * flow.step, span = min(flow.step, left);
        examine(first, at.y, at.applications(), span);
        const double latest = first.latest * unit_of_time(flow.step);
        if (first.what != finding::none && latest > span) { // others may be due after its end
            const double beyond = min(min(latest, (1.0 + beyond_step) * flow.step), left);
            earliest<taylor_order> both;
            examine(both, at.y, at.applications(), beyond);
            if (both.what != finding::none) first = both;
        }
        if (first.what != finding::none) {
            auto out =
                land_on<taylor_order, T, Mode, Shape>(m, first, at.y, at.steps() * flow.step);
            out.examined = examined;
            return out;
        }
        if (left > flow.step) continue;
        const double s = max(left, 0.0);
        auto out = stop(flight_end::horizon, s);
        out.y = flow.template short_flight<taylor_order>(at.y, s);
        return out;
    }
}

} // namespace vi
