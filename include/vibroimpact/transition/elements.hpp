// The states that elements take after an event: soft stops that open or engage, friction that sticks or slips.
//
// Method      A set of states can last from y on if every watch of its mode is inside its limits, or on one
//             and led inside by the first time derivative that is not zero within rounding,
//                 g > 0,  or  g = 0 and g' > 0,  or  g = g' = 0 and g'' > 0, ...               (1)
//             g being the margin to the limit, and if every held row of it is zero: slip speed, to stick.
//             A margin whose derivatives up to `most_zeros` all vanish lasts, too.
//             The present states are kept where they can last; a start has none, and friction that an
//             impulse has brought to rest is decided anew. Else the elements with a watch that is not
//             inside are decided together: of the combinations of their states the first that can last
//             is taken, states in falling order, so that friction sticks where it can. Values alone
//             exclude most states of each before.
//             Contacts at rest and elements are one problem: of every combination the contacts are closed that
//             its own forces press (closing.hpp), and (1) is asked of the mode that holds these. Where
//             they keep a slip speed at zero, friction slips the way it would go without them.      (2)
//             Sticking projects velocities as the coordinates of the mode say (mode_coordinates.hpp).
// Assumes     a state next to the limits that were reached; no impulse acts but those of stops: friction
//             leaves velocities as an impact makes them
// Accuracy    zero is what lies below 64 ulp of the terms of a derivative, those of the next one times a
//             step included; coordinates count with the largest at either end of the flight before,
//             or half of what they counted with there. Where nothing can last so, sixteen times as much is
//             zero: an event may be as far off its limit as the one at which the flight began (4 eps of a
//             release), and the terms of one state cancel in the rows of another
// Fails       undecided: no combination can last; missing: a mode that was not built has this code, and
//             nothing was changed
// Reference   theory.md, "Elements"; Filippov, Differential Equations with Discontinuous Righthand
//             Sides (1988), section 18
#pragma once

#include "vibroimpact/transition/transition.hpp"

namespace vi {

enum class decision { kept, changed, non_unique, undecided, missing };

struct decided_states {
    decision what;
    int code = 0; // of the mode that is missing
};

namespace detail {

// Sizes to which rounding is relative: the largest coordinate, and what counts as zero of a sum with such terms.
struct noise {
    double largest, zero = tie_margin;
};

VI_HD inline double rounding_of(const terms_of_derivative& terms, const noise& of) {
    return of.zero * (terms.adds + terms.per_largest * of.largest);
}

template <int D>
VI_HD inline double largest_of(const vec<double, D>& y, int n) {
    double largest = 0.0;
    for (int i = 0; i < n; ++i)
        largest = max(largest, abs(y[i]));
    return largest;
}

// (1) for one limit: the first derivative of the margin that is not zero, and whether it leads inside.
struct standing {
    int zeros;
    bool inside;
    double margin;
};
template <class Watch, class Flow, int D>
VI_HD inline standing standing_at(const Watch& w, int side, const vec<double, D>& y,
                                  const noise& of, const Flow& flow) {
    const auto& g = w.row;
    const double limit = side > 0 ? g.upper : g.lower;
    const int n = flow.dimension();
    const double margin = side * (limit - guard_value(g, 0, y, n));
    for (int m = 0; m <= most_zeros; ++m) {
        const double d = m == 0 ? margin : -side * guard_value(g, m, y, n);
        const double rounding = rounding_of(w.terms[m], of) + (m == 0 ? of.zero * abs(limit) : 0.0);
        if (abs(d) > rounding) return {m, d > 0.0, margin};
    }
    return {most_zeros + 1, true, margin};
}

// Whether the values alone allow a watch, and whether it is inside all limits.
struct verdict_of_watch {
    bool allowed = true, inside = true;
};
template <class Watch, class Flow, int D>
VI_HD inline verdict_of_watch look_at(const Watch& w, const vec<double, D>& y, const noise& of,
                                      const Flow& flow) {
    const double u = guard_value(w.row, 0, y, flow.dimension());
    const double rounding_of_u = rounding_of(w.terms[0], of);
    verdict_of_watch out;
    if (w.held) {
        // four times, as the states that slip have larger terms than this one, u' being zero here
        out.allowed = abs(u) <= 4.0 * rounding_of_u;
        return {out.allowed, out.allowed};
    }
    for (int side = -1; side <= 1; side += 2) {
        const double limit = side > 0 ? w.row.upper : w.row.lower;
        if (!(abs(limit) < 0x1p1000)) continue;
        const double rounding = rounding_of_u + of.zero * abs(limit);
        const double margin = side * (limit - u);
        out.allowed = out.allowed && margin >= -rounding;
        out.inside = out.inside && margin > rounding;
    }
    return out;
}

// (1) for watch j of a mode: the side on which it is led outside, or 0; `to` says then where the flight starts.
template <class Mode, class States, int D>
VI_HD inline int side_crossed(const Mode& m, int j, const vec<double, D>& y, const noise& of,
                              States& to) {
    const auto& g = m.watched.at[j].row;
    int crossed = 0;
    to.zeros[j] = 0;
    to.offset[j] = 0.0;
    for (int side = -1; side <= 1; side += 2) {
        if (!(abs(side > 0 ? g.upper : g.lower) < 0x1p1000)) continue;
        const auto at = standing_at(m.watched.at[j], side, y, of, m.flow);
        if (!at.inside && crossed == 0) crossed = side;
        if (at.zeros == 0) continue;
        to.zeros[j] = side * at.zeros;
        to.offset[j] = at.margin;
    }
    return crossed;
}

// (1) for all watches of a mode.
template <class Mode, class States, int D>
VI_HD inline bool can_last(const Mode& m, const vec<double, D>& y, const noise& of, States& to) {
    for (int j = 0; j < m.watched.count; ++j) {
        const auto& w = m.watched.at[j];
        to.zeros[j] = 0;
        to.offset[j] = 0.0;
        const auto seen = look_at(w, y, of, m.flow);
        if (!seen.allowed) return false;
        if (!seen.inside && side_crossed(m, j, y, of, to) != 0) return false;
    }
    return true;
}

inline constexpr int sticking_state = 2;

// The side on which a soft stop in this state is passed: odd states are within the upper stop, even ones within the
// lower, 0 is open.
VI_HD inline int side_of_soft(int state) {
    return state == 0 ? 0 : state % 2 != 0 ? 1 : -1;
}

// Whether a soft stop that takes another state is met, from open or from the other side: 1, 2 and 5, 6 press, 3 and 4
// are within without a force.
VI_HD inline bool meets_stop(int was, int is) {
    return is != 3 && is != 4 && is != 0 && side_of_soft(was) != side_of_soft(is);
}

VI_HD inline int state_in_code(int code, int element) {
    return code / whole_power(radix, element) % radix;
}
VI_HD inline int with_state(int code, int element, int state) {
    return code + (state - state_in_code(code, element)) * whole_power(radix, element);
}

// Contacts that an event has left at rest on their stops, of those that were closed.
template <class Flow, class State>
VI_HD inline int still_closed(const hybrid<Flow>& system, const State& at) {
    int code = 0;
    for (int i = 0; i < system.contacts(); ++i) {
        const double side = side_in_code(at.held, i);
        if (side != 0.0 && at.touching[i] == side && plain(at.rate[i]) == 0.0)
            code += code_of(i, side);
    }
    return code;
}

// Whether friction that sticks to a belt leads a contact at rest behind its stop, by the first derivative of the gap
// that is not zero. An open mode.
template <class Flow, class State>
VI_HD inline bool is_driven_in(const hybrid<Flow>& system, const State& at, int contact) {
    const auto& m = system.modes[at.mode];
    if (keeps_gap(m, contact)) return false;
    const auto& g = m.guards[contact];
    const int n = system.dimension();
    const noise of{max(at.elements.size, largest_of(at.y, n))};
    for (int k = 2; k <= most_zeros; ++k) {
        const double d = gap_derivative<double>(system, at, contact, k);
        if (abs(d) > rounding_of({g, k, m.flow}, of)) return d < 0.0;
    }
    return false;
}

// The contacts that are closed beside elements in the states of a code; -1 where these states cannot be. A closed mode
// keeps its own. In an open one they are those of all at rest that these states press; while a contact is approached,
// whose impact comes first, those that are still closed. Undecided: the mode of this set and code is missing.
template <class Flow, class State>
VI_HD inline closing closed_beside(const hybrid<Flow>& system, const State& at, int code) {
    if (!system.is_open(at.mode)) return {system.codes[at.mode] % system.closed_sets(), true};
    const int contacts = system.contacts();
    if (!any_at_rest(at, contacts) || approached(at, contacts) >= 0)
        return {still_closed(system, at), true};
    auto there = at;
    there.elements.code = code;
    const int open = open_mode(system, there);
    if (open < 0) return {0, false};
    there.mode = open;
    if (system.modes[open].watched.constrained && code != at.elements.code)
        there.y = system.from_free[open](there.y, system.dimension());
    set_on_stops(system, there);
    for (int i = 0; i < contacts; ++i)
        if (there.touching[i] != 0.0 && there.rate[i] == 0.0 &&
            held_by_friction(system, there, i) && is_driven_in(system, there, i))
            return {-1, true};
    return closed_set(system, there);
}

// Combinations of the states of some elements, counted through.
template <int Most>
struct combinations {
    int count = 0;
    int element[Most], allowed[Most]; // allowed: bit s for state s

    // The number's combination put into a code; -1 beyond the last.
    VI_HD int of(int number, int code) const {
        for (int i = count - 1; i >= 0; --i) { // the last element varies fastest
            int states = 0;
            for (int s = 0; s < radix; ++s)
                states += allowed[i] >> s & 1;
            if (states == 0) return -1;
            int rank = number % states;
            number = number / states;
            for (int s = radix - 1; s >= 0; --s)
                if (allowed[i] >> s & 1 && rank-- == 0) code = with_state(code, element[i], s);
        }
        return number == 0 ? code : -1;
    }
};

// The elements with a watch in `now` that is not inside, at a start also friction whose slip speed contacts keep at
// zero, or, with `all`, every element; and the states that values allow to each, the others being as they are. Where y
// is in coordinates of closed contacts, with these. `missing`: a mode that this takes.
template <class Flow>
VI_HD inline combinations<Flow::shape_type::max_elements>
open_questions(const hybrid<Flow>& system, const typename hybrid<Flow>::mode_type& now,
               const vec<double, Flow::max_dimension>& y, const noise& of, int closed, int code,
               bool start, bool all, int& missing) {
    combinations<Flow::shape_type::max_elements> out;
    const int sets = system.closed_sets();
    for (int e = 0; e < system.elements.count; ++e) {
        bool asked = all;
        for (int j = 0; j < now.watched.count; ++j)
            if (now.watched.at[j].element == e)
                asked = asked || (start && now.watched.at[j].held && !system.elements.joint[e]) ||
                        !look_at(now.watched.at[j], y, of, now.flow).inside;
        if (!asked) continue;
        int allowed = 0;
        for (int s = 0; s < radix; ++s) {
            if (!(system.elements.states[e] >> s & 1)) continue;
            const int wanted = closed + sets * with_state(code, e, s);
            const int m = system.find_mode(wanted);
            if (m < 0) {
                missing = wanted;
                return out;
            }
            bool may = true;
            for (int j = 0; j < system.modes[m].watched.count; ++j) {
                const auto& w = system.modes[m].watched.at[j];
                // the force that holds it, and what else holds it, depends on what the others do
                const bool known = !system.elements.joint[e] &&
                                   (system.elements.soft[e] || (s == sticking_state) == w.held);
                if (w.element == e && known)
                    may = may && look_at(w, y, of, system.modes[m].flow).allowed;
            }
            if (may) allowed |= 1 << s;
        }
        out.element[out.count] = e;
        out.allowed[out.count++] = allowed;
    }
    return out;
}

// Whether two codes differ only in that friction sticks in the one taken and slips in the other: there the law decides.
template <class Flow>
VI_HD inline bool law_decides(const hybrid<Flow>& system, int taken, int other) {
    for (int e = 0; e < system.elements.count; ++e)
        if (state_in_code(taken, e) != state_in_code(other, e) &&
            (system.elements.soft[e] || state_in_code(taken, e) != sticking_state))
            return false;
    return true;
}

// Watches of an element that are not held.
template <class Mode>
VI_HD inline int free_watches(const Mode& m, int element) {
    int count = 0;
    for (int j = 0; j < m.watched.count; ++j)
        count += m.watched.at[j].element == element && !m.watched.at[j].held;
    return count;
}

// (2) for states that last in mode m: where contacts keep slip speeds at zero, the way they would go beside the
// contacts that stay closed if friction alone held these. `missing`: a mode that this takes.
template <class Flow, class State>
VI_HD inline bool opposes(const hybrid<Flow>& system, const State& at,
                          const typename hybrid<Flow>::mode_type& m, const noise& of, int code,
                          int& missing) {
    const int sets = system.closed_sets(), open = system.find_mode(sets * code);
    if (!system.is_open(at.mode) || open < 0 || &system.modes[open] == &m) return true;
    int stuck = code;
    for (int e = 0; e < system.elements.count; ++e)
        if (!system.elements.soft[e] && !system.elements.joint[e] &&
            state_in_code(code, e) != sticking_state &&
            free_watches(m, e) < free_watches(system.modes[open], e))
            stuck = with_state(stuck, e, sticking_state);
    if (stuck == code) return true;
    const auto beside = closed_beside(system, at, stuck);
    const int wanted = (beside.code < 0 ? 0 : beside.code) + sets * (beside.decided ? code : stuck);
    const int without = beside.decided ? system.find_mode(wanted) : -1;
    if (without < 0) {
        missing = wanted;
        return false;
    }
    auto to = at.elements;
    const auto& watched = system.modes[without].watched;
    for (int j = 0; j < watched.count; ++j) {
        const int e = watched.at[j].element;
        if (!watched.at[j].held && state_in_code(stuck, e) != state_in_code(code, e) &&
            side_crossed(system.modes[without], j, at.y, of, to) != 0)
            return false;
    }
    return true;
}

// Whether friction that slips has been brought to a limit by the impulse of an event, from the state before it.
template <class Flow, int D, class States>
VI_HD inline bool
brought_to_rest(const hybrid<Flow>& system, const typename hybrid<Flow>::mode_type& m,
                const vec<double, D>& before, const noise& of, const States& lasting) {
    for (int j = 0; j < m.watched.count; ++j) {
        const auto& w = m.watched.at[j];
        if (!w.held && !system.elements.soft[w.element] && lasting.zeros[j] != 0 &&
            look_at(w, before, of, m.flow).inside)
            return true;
    }
    return false;
}

// `at` with values only; `before`: the state before the event, in free coordinates, or none.
template <class Flow, class State>
VI_HD inline decided_states decide_states(const hybrid<Flow>& system, const State& at,
                                          const vec<double, Flow::max_dimension>* before,
                                          element_states<Flow::shape_type::max_watches>& to) {
    const int n = system.dimension(), sets = system.closed_sets();
    const auto& y = at.y;
    noise of{max(to.size, largest_of(y, n))}; // rounding is of the whole flight
    const bool start = to.code == no_states;
    if (start) to.code = 0;
    auto closed = closed_beside(system, at, to.code);
    if (!closed.decided) return {decision::missing, closed.code + sets * to.code};
    const bool solved = closed.code >= 0;
    if (!solved) closed.code = still_closed(system, at);
    const int now = system.find_mode(closed.code + sets * to.code);
    if (now < 0) return {decision::missing, closed.code + sets * to.code};
    auto next = to;
    int missing = -1;
    if (!start && solved && can_last(system.modes[now], y, of, next) &&
        !(before && brought_to_rest(system, system.modes[now], *before, of, next))) {
        const bool rather = opposes(system, at, system.modes[now], of, next.code, missing);
        if (missing >= 0) return {decision::missing, missing};
        if (rather) {
            to = next;
            return {decision::kept};
        }
    }
    const int stay = system.is_open(at.mode) ? 0 : closed.code;
    int taken = -1;
    bool unique = true, lasting = false;
    auto best = to;
    for (int all = 0; all < 3 && taken < 0 && !(all == 2 && lasting); ++all) {
        if (all == 2) of.zero = 16.0 * tie_margin;
        const auto asked = open_questions(system, system.modes[now], y, of, stay, to.code, start,
                                          all > 0, missing);
        if (missing >= 0) return {decision::missing, missing};
        for (int number = 0;; ++number) {
            next.code = asked.of(number, to.code);
            if (next.code < 0) break;
            const auto beside = closed_beside(system, at, next.code);
            if (!beside.decided) return {decision::missing, beside.code + sets * next.code};
            if (beside.code < 0) continue;
            const int m = system.find_mode(beside.code + sets * next.code);
            if (m < 0) return {decision::missing, beside.code + sets * next.code};
            auto found = next;
            if (!can_last(system.modes[m], y, of, found)) continue;
            const bool rather = opposes(system, at, system.modes[m], of, found.code, missing);
            if (missing >= 0) return {decision::missing, missing};
            if (rather && taken >= 0) unique = unique && law_decides(system, taken, found.code);
            if (rather ? taken < 0 : !lasting) best = found;
            if (rather && taken < 0) taken = found.code;
            lasting = true;
        }
    }
    if (!lasting) return {decision::undecided};
    to = best;
    return {unique ? decision::changed : decision::non_unique};
}

// A hybrid system as data is in the mode that the last watch gave: where the flight starts on limits, and
// which of them it crosses at once.
template <class T, class Flow>
VI_HD inline decided_states enter_given(const hybrid<Flow>& system,
                                        trajectory<T, typename Flow::shape_type>& at) {
    const auto& m = system.modes[at.mode];
    const auto y = plain_state(at.y, system.dimension());
    const noise of{largest_of(y, system.dimension())};
    auto& to = at.elements;
    if (to.code == no_states) to.code = system.codes[at.mode]; // a motion begins in the first mode
    to.settled = true;
    to.due = 0;
    for (int j = 0; j < m.watched.count; ++j) {
        const int side = side_crossed(m, j, y, of, to);
        if (to.due == 0) to.due = side * (j + 1);
    }
    return {decision::kept};
}

} // namespace detail

// Decide the states of all elements from where the motion is; the trajectory may be in a mode with closed
// contacts, which stays. Not where nothing has happened since it was done. `before`: the state before an event, in
// free coordinates.
template <class T, class Flow>
VI_HD inline decided_states
settle_elements(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                const vec<double, Flow::max_dimension>* before = nullptr) {
    if constexpr (Flow::shape_type::max_elements == 0) {
        return {decision::kept};
    } else {
        if (at.elements.settled || system.elements.count == 0) return {decision::kept};
        if (system.elements.given) return detail::enter_given(system, at);
        const int n = system.dimension(), sets = system.closed_sets();
        const int was = at.elements.code;
        const int closed = system.codes[at.mode] % sets;
        auto states = at.elements;
        const auto out =
            detail::decide_states(system, detail::values(at, n, system.contacts()), before, states);
        if (out.what == decision::missing || out.what == decision::undecided) return out;
        const int code = closed + sets * states.code;
        const int m = system.find_mode(code), base = system.find_mode(sets * states.code);
        if (m < 0) return {decision::missing, code};
        if (base < 0) return {decision::missing, sets * states.code};
        if (system.modes[m].watched.constrained && was != states.code)
            at.y = system.from_free[m](at.y, n);
        at.mode = m;
        at.elements = states;
        at.elements.settled = true;
        at.elements.size = // what a motion that has shrunk at once has lost, it does not win back
            max(detail::largest_of(detail::plain_state(at.y, n), n), 0.5 * at.elements.size);
        return out;
    }
}

} // namespace vi
