// Rest on a stop: chatter completed, sticking begun, and what a release leaves behind.
//
// Method      A touching contact that leaves at rate v with gap acceleration a < 0 comes back after
//             2 v / |a|, leaving at R v, and so on: infinitely many impacts in
//                 t = 2 v / (|a| (1 - R))                                                  (1)
//             after which the relative motion is at rest. The sum is completed by a free flight of
//             length t and one plastic impact.
//             Contacts at rest on their stops close or stay open by the complementarity
//                 force >= 0, gap acceleration >= 0, one of them zero                      (2)
//             Where the gap acceleration itself vanishes its own derivative decides.
// Accuracy    (1) neglects the change of a, which moves the end velocity by about
//             v^2 |g'''| / (a (1 - R))^2, and lumps impulses, which moves positions by about
//             v^2 / (|a| (1 - R)^2): completed only where both are below 2^-53 of the motion (3)
// Fails       sets of contacts whose mode was not built: settled::missing, the code is returned
// Reference   Nordmark, Piiroinen, Nonlinear Dynamics 58 (2009) 85-106; theory.md, "Chatter"
#pragma once

#include "vibroimpact/impact/law.hpp"

namespace vi {

enum class settled { nothing, chatter, stick, missing };

template <class T>
struct rest {
    settled what;
    int contact; // where chatter was completed or sticking begun
    int code;    // of the closed set
    T duration;  // of the completed chatter
};

namespace detail {

VI_HD inline int power_of_three(int n) {
    int p = 1;
    for (int i = 0; i < n; ++i)
        p = 3 * p;
    return p;
}
VI_HD inline int code_of(int contact, double side) {
    return (side > 0.0 ? 1 : 2) * power_of_three(contact);
}
VI_HD inline double side_in_code(int code, int contact) {
    const int digit = code / power_of_three(contact) % 3;
    return digit == 1 ? 1.0 : digit == 2 ? -1.0 : 0.0;
}

// The first contact in a closed set that was not in it before, or -1.
VI_HD inline int newly_closed(int code, int before, int contacts) {
    for (int i = 0; i < contacts; ++i)
        if (side_in_code(code, i) != 0.0 && side_in_code(before, i) == 0.0) return i;
    return -1;
}

// m-th derivative of the gap of a touching contact, in the mode the trajectory is in.
template <class T, class Flow, class State>
VI_HD inline T gap_derivative(const hybrid<Flow>& system, const State& at, int i, int m) {
    const T u = watch(system.modes[at.mode].guards[i], m, at.y, system.dimension());
    return -at.touching[i] * u;
}
template <class Flow, class State>
VI_HD inline double rounding_of(const hybrid<Flow>& system, const State& at, int i, int m) {
    const auto& mode = system.modes[at.mode];
    return 64.0 * unit_roundoff *
           plain(magnitude(mode.guards[i], m, at.y, system.dimension(), mode.flow.step));
}

// (3)
template <class Flow, class State>
VI_HD inline bool chatter_is_summable(const hybrid<Flow>& system, const State& at, int i) {
    const double v = at.rate[i];
    const double r = restitution_at(system, i, at.touching[i]);
    const double a = gap_derivative<double>(system, at, i, 2);
    if (!(a < -rounding_of(system, at, i, 2)) || r >= 1.0) return false;
    const double jerk = abs(gap_derivative<double>(system, at, i, 3));
    const auto& mode = system.modes[at.mode];
    const int n = system.dimension();
    const double place =
        magnitude(mode.guards[i], 0, at.y, n, mode.flow.step) + mode.guards[i].reach;
    const double speed = magnitude(mode.guards[i], 1, at.y, n, mode.flow.step);
    const double lost = (1.0 - r) * (1.0 - r);
    return v * v * jerk <= unit_roundoff * speed * a * a * lost &&
           v * v <= unit_roundoff * place * -a * lost;
}

// Values of a jet trajectory, so that the tests above are the same for every scalar.
template <class T, class Shape>
VI_HD inline trajectory<double, Shape> values(const trajectory<T, Shape>& at, int n, int contacts) {
    trajectory<double, Shape> out{};
    out.mode = at.mode;
    out.held = at.held;
    for (int i = 0; i < n; ++i)
        out.y[i] = plain(at.y[i]);
    for (int i = 0; i < contacts; ++i) {
        out.touching[i] = plain(at.touching[i]);
        out.rate[i] = plain(at.rate[i]);
        out.flat[i] = plain(at.flat[i]);
    }
    return out;
}

// Gap accelerations of the resting contacts; ties are decided by the third derivative.
template <class Flow, class State>
VI_HD inline double tendency(const hybrid<Flow>& system, const State& at, int i, bool& tie) {
    const double a = gap_derivative<double>(system, at, i, 2);
    const double noise = rounding_of(system, at, i, 2);
    tie = abs(a) <= noise || at.flat[i] != 0.0;
    if (!tie) return a;
    const double jerk = gap_derivative<double>(system, at, i, 3);
    return jerk > rounding_of(system, at, i, 3) ? 0.0 : -noise;
}

} // namespace detail

// Enter the mode with this code; the trajectory is in free coordinates.
template <class T, class Flow>
VI_HD inline bool enter_mode(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at, int code) {
    const int m = system.find_mode(code);
    if (m < 0) return false;
    if (m > 0) at.y = system.from_free[m](at.y, system.dimension());
    at.mode = m;
    at.held = code;
    return true;
}

template <class T, class Flow>
VI_HD inline void leave_mode(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at) {
    if (at.mode > 0) at.y = system.to_free[at.mode](at.y, system.dimension());
    at.mode = 0;
}

// Which resting contacts close: (2). Sets flat where a resting contact opens from zero force.
template <class Flow>
VI_HD inline int closed_set(const hybrid<Flow>& system,
                            trajectory<double, typename Flow::shape_type>& at) {
    constexpr int N = Flow::max_contacts;
    small_system<N> problem{};
    int index[N] = {};
    for (int i = 0; i < system.contacts(); ++i)
        if (at.touching[i] != 0.0 && at.rate[i] == 0.0) index[problem.n++] = i;
    for (int i = 0; i < problem.n; ++i) {
        bool tie = false;
        problem.b[i] = detail::tendency(system, at, index[i], tie);
        at.flat[index[i]] = tie ? 1.0 : 0.0;
        for (int j = 0; j < problem.n; ++j)
            problem.a[i][j] = gap_mobility(system, at, index[i], index[j]);
    }
    const auto solution = solve_complementarity(problem);
    if (solution.active < 0) return -1;
    int code = 0;
    for (int i = 0; i < problem.n; ++i)
        if (solution.active >> i & 1) code += detail::code_of(index[i], at.touching[index[i]]);
    return code;
}

// The contacts of a code, at rest on their stops.
template <class T, class Flow>
VI_HD inline void touch_held(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at, int code) {
    for (int i = 0; i < system.contacts(); ++i) {
        const double side = detail::side_in_code(code, i);
        if (side == 0.0) continue;
        at.touching[i] = side;
        at.rate[i] = T(0.0);
    }
}

namespace detail {

// Duration (1) of the chatter of one contact.
template <class T, class Flow, class State>
VI_HD inline T chatter_time(const hybrid<Flow>& system, const State& at, int i) {
    const double r = restitution_at(system, i, plain(at.touching[i]));
    return 2.0 * at.rate[i] / (-gap_derivative<T>(system, at, i, 2) * (1.0 - r));
}

// Do all other contacts stay away from their stops for a time t? A bound, in no way tight.
template <class Flow, class State>
VI_HD inline bool others_stay_open(const hybrid<Flow>& system, const State& at, int chattering,
                                   double t) {
    const auto& mode = system.modes[at.mode];
    const int n = system.dimension();
    for (int j = 0; j < system.contacts(); ++j) {
        if (j == chattering || side_in_code(at.held, j) != 0.0) continue;
        const auto& g = mode.guards[j];
        const double u = watch(g, 0, at.y, n);
        const double moved = 2.0 * t * magnitude(g, 1, at.y, n, mode.flow.step);
        if (at.touching[j] == 0.0) {
            if (min(g.upper - u, u - g.lower) <= moved) return false;
            continue;
        }
        const double bend = 2.0 * t * magnitude(g, 2, at.y, n, mode.flow.step);
        const double eps = rounding_of(system, at, j, 0) + 64.0 * unit_roundoff * g.reach;
        if (!(at.rate[j] > bend && at.rate[j] * t > 4.0 * eps)) return false;
    }
    return true;
}

} // namespace detail

// The sum (1): a flight in the present mode, then one plastic impact of the contact and those held.
template <class T, class Flow>
VI_HD inline T complete_chatter(const hybrid<Flow>& system,
                                trajectory<T, typename Flow::shape_type>& at, int i) {
    const T t = detail::chatter_time<T>(system, at, i);
    at.y = system.modes[at.mode].flow.template short_flight<taylor_order>(at.y, t);
    leave_mode(system, at);
    const double side = plain(at.touching[i]);
    for (int j = 0; j < system.contacts(); ++j)
        at.touching[j] = 0.0; // the others have left (others_stay_open)
    at.touching[i] = side;
    at.rate[i] = detail::gap_derivative<T>(system, at, i, 1);
    touch_held(system, at, at.held);
    resolve_impact(system, at, 0.0);
    at.rate[i] = T(0.0);
    return t;
}

// Is a touching contact being approached? A start given from outside can say so, or the impulses of
// an impact elsewhere: it strikes next, at the same instant.
template <class T, class Shape>
VI_HD inline int approached(const trajectory<T, Shape>& at, int contacts) {
    for (int i = 0; i < contacts; ++i)
        if (at.touching[i] != 0.0 && plain(at.rate[i]) < 0.0) return i;
    return -1;
}

// After an event elsewhere the contacts held before may stay closed: the motion goes on in their mode,
// unless another impact comes first.
template <class T, class Flow>
VI_HD inline void stay_closed(const hybrid<Flow>& system,
                              trajectory<T, typename Flow::shape_type>& at) {
    if (at.mode != 0 || at.held == 0 || approached(at, system.contacts()) >= 0) return;
    auto plain = detail::values(at, system.dimension(), system.contacts());
    if (closed_set(system, plain) == at.held) enter_mode(system, at, at.held);
}

// Before a flight: begin sticking, complete chatter.
template <class T, class Flow>
VI_HD inline rest<T> settle(const hybrid<Flow>& system,
                            trajectory<T, typename Flow::shape_type>& at, double horizon) {
    const int n = system.dimension(), contacts = system.contacts();
    auto plain = detail::values(at, n, contacts);
    if (at.mode == 0) {
        const int code = closed_set(system, plain);
        for (int i = 0; i < contacts; ++i)
            at.flat[i] = plain.flat[i];
        const int before = at.held;
        if (code < 0 || !enter_mode(system, at, code)) return {settled::missing, -1, code, T(0.0)};
        const int fresh = detail::newly_closed(code, before, contacts);
        if (fresh >= 0) return {settled::stick, fresh, code, T(0.0)};
        plain = detail::values(at, n, contacts);
    }
    for (int i = 0; i < contacts; ++i) {
        if (at.touching[i] == 0.0 || detail::side_in_code(at.held, i) != 0.0 ||
            !(plain.rate[i] > 0.0) || !detail::chatter_is_summable(system, plain, i))
            continue;
        const double t = detail::chatter_time<double>(system, plain, i);
        if (!(t <= horizon) || !detail::others_stay_open(system, plain, i, t)) continue;
        return {settled::chatter, i, 0, complete_chatter(system, at, i)};
    }
    return {settled::nothing, -1, 0, T(0.0)};
}

} // namespace vi
