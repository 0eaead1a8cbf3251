// Contacts that rest on their stops: which of them stay closed, and which open.
//
// Method      Forces f along the gaps of resting contacts make their gap accelerations a = b + A f, b
//             those of open flight and A the mobility beside friction that sticks, and
//                 0 <= f  complementary to  a >= 0                                         (1)
//             has one solution. Contacts with a = 0 and f = 0 within rounding are ties. With the others
//             of (1) closed or open, the next derivative decides them: forces that grow at rates r
//             make their gap jerks
//                 c + A' r,   0 <= r  complementary to  c + A' r >= 0                      (2)
//             where c are the jerks in the mode of the closed ones, ties being open, and A' is the
//             mobility that is left beside these, A_tt - A_tc A_cc^-1 A_ct. What ties in (2), closes,
//             and stays closed until its force is negative beyond rounding: bodies that move along
//             together without a force between them touch for ever.
// Assumes     gap rates of resting contacts are zero
// Fails       (1) or (2) has no solution within rounding; a mode that was not built
// Reference   theory.md, "Sticking and release"
#pragma once

#include "vibroimpact/transition/impact_law.hpp"

namespace vi {

// Contacts that stay closed, as a code; -1 where (1) or (2) has no solution. Where ties are not
// decided yet, the mode of this code is needed for it.
struct closing {
    int code;
    bool decided;
};

namespace detail {

VI_HD inline int code_of(int contact, double side) {
    return (side > 0.0 ? 1 : 2) * whole_power(3, contact);
}
VI_HD inline double side_in_code(int code, int contact) {
    const int digit = code / whole_power(3, contact) % 3;
    return digit == 1 ? 1.0 : digit == 2 ? -1.0 : 0.0;
}

// m-th derivative of the gap of a touching contact, in the mode the trajectory is in.
template <class T, class Flow, class State>
VI_HD inline T gap_derivative(const hybrid<Flow>& system, const State& at, int i, int m) {
    const T u = guard_value(system.modes[at.mode].guards[i], m, at.y, system.dimension());
    return -at.touching[i] * u;
}
template <class Flow, class State>
VI_HD inline double rounding_of(const hybrid<Flow>& system, const State& at, int i, int m) {
    const auto& mode = system.modes[at.mode];
    return 64.0 * unit_roundoff * plain(magnitude(mode.guards[i], m, at.y, mode.flow));
}

// Mobility of the gap of i by a force at j beside friction that sticks in the open mode of the trajectory: what
// entering that mode makes of an impulse.
template <class Flow, class State>
VI_HD inline double held_mobility(const hybrid<Flow>& system, const State& at, int i, int j) {
    const double free = gap_mobility(system, at, i, j);
    if constexpr (Flow::shape_type::max_elements > 0) {
        const auto& mode = system.modes[at.mode];
        if (!mode.watched.constrained) return free;
        const auto& project = system.from_free[at.mode].matrix;
        const int n = system.dimension();
        double sum = 0.0;
        for (int k = 0; k < n; ++k)
            sum = sum + mode.guards[i].rows[1][k] * dot(project[k], system.laws[j].impulse, n, 0.0);
        return at.touching[i] * at.touching[j] * sum;
    }
    return free;
}
// held_mobility of a motion, in place of gap_mobility_in.
template <class Flow, class State>
VI_HD inline auto held_mobility_in(const hybrid<Flow>& system, const State& at) {
    return [&](int i, int j) VI_WITHIN { return held_mobility(system, at, i, j); };
}
// Whether friction that sticks holds the gap of a contact: it takes no force while that lasts.
template <class Flow, class State>
VI_HD inline bool held_by_friction(const hybrid<Flow>& system, const State& at, int i) {
    if constexpr (Flow::shape_type::max_elements > 0)
        return held_mobility(system, at, i, i) <= 0x1p-40 * gap_mobility(system, at, i, i);
    return false;
}

// Size of the terms of the force that it takes to hold the gap of i, beside the other contacts at rest.
// Free coordinates.
template <class Flow, class State>
VI_HD inline double terms_of_force(const hybrid<Flow>& system, const State& at, int i) {
    double sum = 0.0;
    for (int j = 0; j < system.contacts(); ++j) {
        if (at.touching[j] == 0.0 || at.rate[j] != 0.0) continue;
        const double share = abs(gap_mobility(system, at, i, j)) / system.laws[j].mobility[j];
        sum = sum + share * terms_of(system, at, j, 2);
    }
    return sum / system.laws[i].mobility[i];
}

// Resting contacts: those that are known to tie, the others, and (1) for these.
template <int N>
struct resting_contacts {
    contact_list<N> ties{}, others{};
    small_system<N> problem{};
};
template <class Flow, class State>
VI_HD inline auto find_resting(const hybrid<Flow>& system, const State& at) {
    resting_contacts<Flow::max_contacts> out;
    for (int i = 0; i < system.contacts(); ++i)
        if (at.touching[i] != 0.0 && at.rate[i] == 0.0 && !held_by_friction(system, at, i))
            (at.flat[i] != 0.0 ? out.ties : out.others).add(i);
    out.problem = mobilities_of(out.others, held_mobility_in(system, at));
    auto& p = out.problem;
    for (int i = 0; i < p.n; ++i) {
        const int ci = out.others.index[i];
        p.b[i] = gap_derivative<double>(system, at, ci, 2);
        p.slack[i] = tie_margin * p.a[i][i] * terms_of_force(system, at, ci);
    }
    return out;
}

// A_cc^-1 A_ct for the tie t; c are the active contacts of the problem.
template <class Flow, class State, int N>
VI_HD inline vec<double, N> shares_of(const hybrid<Flow>& system, const State& at,
                                      const resting_contacts<N>& resting, int active, int tie) {
    small_system<N> beside = resting.problem;
    for (int i = 0; i < beside.n; ++i)
        beside.b[i] = -held_mobility(system, at, resting.others.index[i], tie);
    vec<double, N> shares{};
    solve_active(beside, active, shares);
    return shares;
}

// (2); `there` is the trajectory in the mode of the active contacts.
template <class Flow, class State, int N>
VI_HD inline small_system<N> problem_of_ties(const hybrid<Flow>& system, const State& at,
                                             const State& there, const resting_contacts<N>& resting,
                                             int active) {
    const auto& ties = resting.ties;
    small_system<N> p{};
    p.n = ties.count;
    for (int j = 0; j < p.n; ++j) {
        const auto shares = shares_of(system, at, resting, active, ties.index[j]);
        p.b[j] = gap_derivative<double>(system, there, ties.index[j], 3);
        p.slack[j] = terms_of(system, at, ties.index[j], 3);
        for (int c = 0; c < resting.others.count; ++c)
            if (active >> c & 1)
                p.slack[j] += abs(shares[c]) * terms_of(system, at, resting.others.index[c], 3);
        p.slack[j] = tie_margin * p.slack[j];
        for (int i = 0; i < p.n; ++i) {
            p.a[i][j] = held_mobility(system, at, ties.index[i], ties.index[j]);
            for (int c = 0; c < resting.others.count; ++c)
                if (active >> c & 1)
                    p.a[i][j] -= held_mobility(system, at, ties.index[i], resting.others.index[c]) *
                                 shares[c];
        }
    }
    return p;
}

// Solve (1) or (2): which contacts close, and which tie, opening and force both within rounding.
struct solution {
    int closed, tied; // bit i: contact i of the problem; closed is -1 where there is no solution
};
template <int N>
VI_HD inline solution solve_with_ties(const small_system<N>& p) {
    const auto found = solve_complementarity(p);
    if (found.active < 0) return {-1, 0};
    solution out{found.active, 0};
    for (int i = 0; i < p.n; ++i) {
        const double pressed = p.a[i][i] * found.x[i];
        if ((found.active >> i & 1 ? pressed : left_over(p, i, found.x)) > p.slack[i]) continue;
        out.closed &= ~(1 << i);
        out.tied |= 1 << i;
    }
    return out;
}

// What flat says of a contact that is closed without force, with the other sign: it takes twice the
// margin of a tie to open it, so that it does not tie again. Never zero.
template <class Flow, class State>
VI_HD inline double unloaded(const hybrid<Flow>& system, const State& at, int i) {
    return max(2.0 * terms_of_force(system, at, i), 0x1p-1000);
}

// The code of the active ones among contacts.
template <class State, int N>
VI_HD inline int code_of_active(const State& at, const contact_list<N>& contacts, int active) {
    int code = 0;
    for (int i = 0; i < contacts.count; ++i)
        if (active >> i & 1) code += code_of(contacts.index[i], at.touching[contacts.index[i]]);
    return code;
}

} // namespace detail

// Code of the mode that holds a closed set, elements being in their present states. What is no set has no mode.
template <class Flow, class State>
VI_HD inline int mode_code(const hybrid<Flow>& system, const State& at, int closed) {
    if constexpr (Flow::shape_type::max_elements > 0)
        if (closed >= 0) return closed + system.closed_sets() * at.elements.code;
    return closed;
}
// The mode that holds nothing closed. It is built before any other of these states.
template <class Flow, class State>
VI_HD inline int open_mode(const hybrid<Flow>& system, const State& at) {
    if constexpr (Flow::shape_type::max_elements > 0)
        return system.find_mode(mode_code(system, at, 0));
    else
        return 0;
}

// Enter the mode with this code; the trajectory is in free coordinates.
template <class T, class Flow>
VI_HD inline bool enter_mode(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at, int code) {
    const int m = system.find_mode(mode_code(system, at, code));
    if (m < 0) return false;
    if (!system.is_open(m)) at.y = system.from_free[m](at.y, system.dimension());
    at.mode = m;
    at.held = code;
    return true;
}

template <class T, class Flow>
VI_HD inline auto in_free_coordinates(const hybrid<Flow>& system,
                                      const trajectory<T, typename Flow::shape_type>& at) {
    return system.is_open(at.mode) ? at.y : system.to_free[at.mode](at.y, system.dimension());
}

template <class T, class Flow>
VI_HD inline void leave_mode(const hybrid<Flow>& system,
                             trajectory<T, typename Flow::shape_type>& at) {
    at.y = in_free_coordinates(system, at);
    at.mode = open_mode(system, at);
}

// (1), then (2); free coordinates. Sets flat where a resting contact tied in (1): one that opens does
// so with zero acceleration, one that closes with zero force. What ties in (2), too, closes: its force
// is zero within rounding, and flat says of what. A tie that depends on what is closed stays where it
// is, as that holds it, too.
template <class Flow>
VI_HD inline closing closed_set(const hybrid<Flow>& system,
                                trajectory<double, typename Flow::shape_type>& at) {
    auto resting = detail::find_resting(system, at);
    const auto pressed = detail::solve_with_ties(resting.problem);
    if (pressed.closed < 0) return {-1, true};
    detail::contact_list<Flow::max_contacts> closed{}, ties{};
    for (int i = 0; i < resting.others.count; ++i) {
        at.flat[resting.others.index[i]] = 0.0;
        if (pressed.tied >> i & 1) resting.ties.add(resting.others.index[i]);
        if (pressed.closed >> i & 1) closed.add(resting.others.index[i]);
    }
    for (int i = 0; i < resting.ties.count; ++i) {
        auto beside = closed;
        if (detail::add_independent(beside, resting.ties.index[i],
                                    detail::held_mobility_in(system, at)))
            ties.add(resting.ties.index[i]);
    }
    resting.ties = ties;
    const int code = detail::code_of_active(at, resting.others, pressed.closed);
    if (ties.count == 0) return {code, true};
    auto there = at;
    if (!enter_mode(system, there, code)) return {code, false};
    const auto growing = detail::solve_with_ties(
        detail::problem_of_ties(system, at, there, resting, pressed.closed));
    if (growing.closed < 0) return {-1, true};
    int closing_ties = growing.closed;
    for (int i = 0; i < ties.count; ++i) {
        at.flat[ties.index[i]] = 1.0;
        if (growing.closed >> i & 1) closed.add(ties.index[i]);
    }
    for (int i = 0; i < ties.count; ++i) {
        const int tie = ties.index[i];
        if (!(growing.tied >> i & 1) ||
            !detail::add_independent(closed, tie, detail::held_mobility_in(system, at)))
            continue;
        at.flat[tie] = -detail::unloaded(system, at, tie);
        closing_ties |= 1 << i;
    }
    return {code + detail::code_of_active(at, ties, closing_ties), true};
}

} // namespace vi
