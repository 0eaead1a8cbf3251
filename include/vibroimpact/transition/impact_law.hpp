// The impact law: Newton restitution at one contact; where several close at once Moreau's law, or one after the other.
//
// Method      gamma = gap rates of the touching contacts before, p = impulses >= 0 along the gaps:
//               gamma+ = gamma + A p,  0 <= p  complementary to  gamma+ + R gamma >= 0      (1)
//             with A the mobility (M^-1 seen at the contacts). One contact: (1) of restitution.hpp,
//               p = -(1 + R) gamma / A,   gamma+ = -R gamma                                 (2)
//             y changes by impulse * p: a jump of rank one per contact, its forces internal, so
//             momentum is kept exactly and energy falls by (1 - R^2) gamma^2 / (2 A) in (2).
//             A touching contact that already leaves (gamma > 0) takes no part: it would be made to
//             bounce by an impact that it did not suffer, and energy could grow. If the impulses of
//             the others drive it together it strikes next, at the same instant. Nor does a contact at
//             rest that forces pull open (transition.hpp).
//             With the sequential law contacts strike alone, by (2), in the order of their numbers, round
//             after round, until none approaches                                           (3)
// Assumes     0 <= R <= 1. Contacts that close together but do not share a body have A_ij = 0: then
//             (1) is (2) for each.
// Accuracy    In (3) a rate that is rounding of those the contact has had at this instant is zero: sequences
//             that die out geometrically end at rest
// Fails       false where (1) has no solution: dependent contacts of which none opens without another. What
//             (3) has not ended after `most_rounds` goes on as another event of the instant.
// Reference   Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988)
#pragma once

#include "vibroimpact/search/certified_flight.hpp"
#include "vibroimpact/transition/complementarity.hpp"
#include "vibroimpact/transition/restitution.hpp"

namespace vi {

template <class Flow>
VI_HD inline double restitution_at(const hybrid<Flow>& system, int contact, double side) {
    const auto& law = system.laws[contact];
    return side > 0.0 ? law.restitution_upper : law.restitution_lower;
}

// Mobility between the gaps of two contacts, whose sides turn the signs.
template <class Flow, class State>
VI_HD inline double gap_mobility(const hybrid<Flow>& system, const State& at, int i, int j) {
    return plain(at.touching[i]) * plain(at.touching[j]) * system.laws[i].mobility[j];
}

// Add p along the gap of a contact: away from the stop.
template <class T, class R, class Side, int Dimension, int Contacts>
VI_HD inline void push_away(vec<T, Dimension>& y, int n,
                            const contact_law<R, Dimension, Contacts>& law, const Side& side,
                            const T& p) {
    const T against = side * p;
    for (int i = 0; i < n; ++i)
        push(y[i], law.impulse[i], against);
}

namespace detail {

template <int N>
struct contact_list {
    int count = 0;
    int index[N] = {};
    VI_HD void add(int contact) { index[count++] = contact; }
};
// The touching contacts that do not leave, in index order.
template <int N, class State>
VI_HD inline contact_list<N> touching_contacts(const State& at, int contacts) {
    contact_list<N> list;
    for (int i = 0; i < contacts; ++i)
        if (at.touching[i] != 0.0 && plain(at.rate[i]) <= 0.0) list.add(i);
    return list;
}

// gap_mobility of a motion, for the two functions below.
template <class Flow, class State>
VI_HD inline auto gap_mobility_in(const hybrid<Flow>& system, const State& at) {
    return [&](int i, int j) VI_WITHIN { return gap_mobility(system, at, i, j); };
}
// A of (1) for the contacts of a list, by the mobility between two of them.
template <int N, class Mobility>
VI_HD inline small_system<N> mobilities_of(const contact_list<N>& list, const Mobility& mobility) {
    small_system<N> p{};
    p.n = list.count;
    for (int i = 0; i < p.n; ++i)
        for (int j = 0; j < p.n; ++j)
            p.a[i][j] = mobility(list.index[i], list.index[j]);
    return p;
}
template <int N, class Flow, class State>
VI_HD inline small_system<N> mobilities_of(const hybrid<Flow>& system, const State& at,
                                           const contact_list<N>& list) {
    return mobilities_of(list,
                         [&](int i, int j) VI_WITHIN { return gap_mobility(system, at, i, j); });
}
// Add a contact to a list, unless it depends on those of it.
template <int N, class Mobility>
VI_HD inline bool add_independent(contact_list<N>& list, int contact, const Mobility& mobility) {
    auto longer = list;
    longer.add(contact);
    vec<double, N> none{};
    const bool independent =
        solve_active(mobilities_of(longer, mobility), (1 << longer.count) - 1, none);
    if (independent) list = longer;
    return independent;
}
// Change of the rate of a contact by the impulses p of a list; zero where it is only rounding.
template <class T, int N, class Flow, class State>
VI_HD inline void push_rate(const hybrid<Flow>& system, State& at, int contact,
                            const contact_list<N>& list, const vec<T, N>& p) {
    double terms = abs(plain(at.rate[contact]));
    for (int j = 0; j < list.count; ++j) {
        const T change = gap_mobility(system, at, contact, list.index[j]) * p[j];
        at.rate[contact] = at.rate[contact] + change;
        terms += abs(plain(change));
    }
    if (abs(plain(at.rate[contact])) <= tie_margin * terms) at.rate[contact] = T(0.0);
}

// p of the active set with derivatives: A_SS p_S = -(1 + R) gamma_S, by the inverse applied to T.
template <class T, int N>
VI_HD inline void active_impulses(const small_system<N>& p, int set, const vec<T, N>& b,
                                  vec<T, N>& x) {
    for (int i = 0; i < p.n; ++i)
        x[i] = T(0.0);
    for (int j = 0; j < p.n; ++j) {
        if (!(set >> j & 1)) continue;
        small_system<N> unit = p; // column j of the inverse
        for (int i = 0; i < p.n; ++i)
            unit.b[i] = i == j ? -1.0 : 0.0;
        vec<double, N> column{};
        solve_active(unit, set, column);
        for (int i = 0; i < p.n; ++i)
            if (set >> i & 1) x[i] = x[i] - column[i] * b[j];
    }
}

// The impulses of a list and its active contacts, -1 where (1) has no solution. Of one contact, by (2).
template <class T, int N, class Flow, class State>
VI_HD inline int impulses_of(const hybrid<Flow>& system, const State& at,
                             const contact_list<N>& list, const vec<T, N>& b, vec<T, N>& p) {
    if (list.count == 1) {
        const double inverse = system.laws[list.index[0]].effective_mass;
        p[0] = T(0.0);
        if (plain(b[0]) >= 0.0) return 0;
        if (!(plain(b[0]) < 0.0 && inverse > 0.0)) return -1;
        p[0] = -(b[0] * inverse);
        return 1;
    }
    auto problem = mobilities_of(system, at, list);
    for (int i = 0; i < list.count; ++i) {
        problem.b[i] = plain(b[i]);
        for (int j = 0; j < list.count; ++j) // what the impulse of j alone would do to i
            problem.slack[i] += tie_margin * abs(problem.a[i][j] / problem.a[j][j] * plain(b[j]));
    }
    const int active = solve_complementarity(problem).active;
    if (active >= 0) active_impulses(problem, active, b, p);
    return active;
}

// The impact of one contact that approaches, by (2): the rates of others that touch change with it.
template <class T, class Flow>
VI_HD inline void strike(const hybrid<Flow>& system, trajectory<T, typename Flow::shape_type>& at,
                         int contact, double restitution) {
    constexpr int N = Flow::max_contacts;
    const auto alone = rebound_of(at.rate[contact], restitution);
    contact_list<N> list{};
    list.add(contact);
    vec<T, N> p{};
    p[0] = -(alone.change * system.laws[contact].effective_mass);
    push_away(at.y, system.dimension(), system.laws[contact], plain(at.touching[contact]), p[0]);
    for (int j = 0; j < system.contacts(); ++j)
        if (j != contact && at.touching[j] != 0.0) push_rate(system, at, j, list, p);
    at.rate[contact] = alone.rate;
    at.flat[contact] = 0.0;
}

inline constexpr int most_rounds = 4096;

// (3)
template <class T, class Flow>
VI_HD inline void strike_in_turn(const hybrid<Flow>& system,
                                 trajectory<T, typename Flow::shape_type>& at, double elasticity) {
    const int contacts = system.contacts();
    double largest[Flow::max_contacts] = {}; // rates at this instant
    bool approached = true;
    for (int round = 0; approached && round < most_rounds; ++round) {
        approached = false;
        for (int i = 0; i < contacts; ++i) {
            if (at.touching[i] == 0.0) continue;
            const double rate = plain(at.rate[i]);
            largest[i] = max(largest[i], abs(rate));
            if (abs(rate) <= tie_margin * largest[i]) at.rate[i] = T(0.0);
            if (!(plain(at.rate[i]) < 0.0)) continue;
            strike(system, at, i, elasticity * restitution_at(system, i, plain(at.touching[i])));
            approached = true;
        }
    }
}

} // namespace detail

// Resolve the impact of all touching contacts; at.rate holds gap rates before and after.
// The trajectory is in free coordinates. elasticity = 0 makes every contact perfectly plastic.
template <class T, class Flow>
VI_HD inline bool resolve_impact(const hybrid<Flow>& system,
                                 trajectory<T, typename Flow::shape_type>& at,
                                 double elasticity = 1.0) {
    constexpr int N = Flow::max_contacts;
    const int n = system.dimension();
    if (system.together == impact_law::sequential) {
        detail::strike_in_turn(system, at, elasticity);
        return true;
    }
    const auto list = detail::touching_contacts<N>(at, system.contacts());
    vec<T, N> b{}, after{}, p{};
    for (int i = 0; i < list.count; ++i) {
        const int ci = list.index[i];
        const double r = elasticity * restitution_at(system, ci, plain(at.touching[ci]));
        const auto alone = rebound_of(at.rate[ci], r);
        b[i] = alone.change;
        after[i] = alone.rate;
    }
    const int active = detail::impulses_of(system, at, list, b, p);
    if (active < 0) return false;
    for (int i = 0; i < system.contacts(); ++i) // those that leave are pushed along
        if (at.touching[i] != 0.0 && plain(at.rate[i]) > 0.0)
            detail::push_rate(system, at, i, list, p);
    for (int i = 0; i < list.count; ++i) {
        const int ci = list.index[i];
        const double side = plain(at.touching[ci]);
        if (active >> i & 1) {
            push_away(at.y, n, system.laws[ci], side, p[i]);
            at.rate[ci] = after[i];
        } else {
            detail::push_rate(system, at, ci, list, p);
        }
        at.flat[ci] = 0.0;
    }
    return true;
}

namespace detail {

// Of coordinates that were `before`, and are only rounding of that now, nothing is left: no force that is nothing else
// decides what follows.
template <class T, int D>
VI_HD inline void drop_rounding(vec<T, D>& y, const vec<T, D>& before, int n) {
    for (int j = 0; j < n; ++j)
        if (abs(plain(y[j])) <= tie_margin * abs(plain(before[j]))) y[j] = with_value(y[j], 0.0);
}

} // namespace detail

// Put all touching contacts on their stops exactly, at the rates that the law gave them: what rounding
// has moved in y must not add up over many micro-bounces. All at once, as one moves the others; those that
// depend on others follow these. Free coordinates.
template <class T, class Flow>
VI_HD inline void set_on_stops(const hybrid<Flow>& system,
                               trajectory<T, typename Flow::shape_type>& at) {
    constexpr int N = Flow::max_contacts;
    const int n = system.dimension();
    detail::contact_list<N> list{};
    for (int i = 0; i < system.contacts(); ++i)
        if (at.touching[i] != 0.0)
            detail::add_independent(list, i, detail::gap_mobility_in(system, at));
    const auto problem = detail::mobilities_of(system, at, list);
    const int all = (1 << list.count) - 1;
    vec<T, N> behind{}, slow{}, p{};
    for (int i = 0; i < list.count; ++i) {
        const auto& guard = system.modes[0].guards[list.index[i]];
        const double side = plain(at.touching[list.index[i]]);
        behind[i] =
            side * ((side > 0.0 ? guard.upper : guard.lower) - guard_value(guard, 0, at.y, n));
    }
    detail::active_impulses(problem, all, behind, p);
    const auto before = at.y;
    for (int i = 0; i < list.count; ++i)
        for (int j = 0; j < n; ++j) {
            const auto& law = system.laws[list.index[i]];
            at.y[j] = at.y[j] - law.shift[j] * (plain(at.touching[list.index[i]]) * p[i]);
        }
    for (int i = 0; i < list.count; ++i) { // only now: a displacement may move rates by rounding
        const int c = list.index[i];
        slow[i] = -at.rate[c] -
                  plain(at.touching[c]) * guard_value(system.modes[0].guards[c], 1, at.y, n);
    }
    detail::active_impulses(problem, all, slow, p);
    for (int i = 0; i < list.count; ++i)
        push_away(at.y, n, system.laws[list.index[i]], plain(at.touching[list.index[i]]), p[i]);
    detail::drop_rounding(at.y, before, n);
}

} // namespace vi
