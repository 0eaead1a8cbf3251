// A piecewise-linear hybrid system: modes, guards, jumps, as data.
//
//   mode     a linear flow and one guard per contact. Mode 0 is free: every contact open. Another
//            mode holds a set of contacts closed (sticking); its code is the sum over contacts of
//            3^i (1 at the upper, 2 at the lower stop).
//   element  a soft stop or a friction joint: it has states of its own, 0, 1, ..., each with another flow
//            and with watches, guards that say how long the state lasts. A mode has one state for every
//            element: to its code 3^contacts times their number is added, digits in base `radix`.
//   guard    a row with limits (system/guard.hpp): the distance to a stop, or a contact force.
//   jump     an impact adds impulse * p to y in the free mode: the matrix I + w r. Between modes y
//            is carried by an affine map; entering a mode projects velocities as a perfectly
//            plastic impact does.
//
// The last `lines` pairs of y are the forcing lines (sin theta, omega cos theta) in every mode.
#pragma once

#include "vibroimpact/system/large_mode.hpp"
#include "vibroimpact/system/stride.hpp"

namespace vi {

// Numbers of a flow without blocks that strides read.
struct no_view {};
template <class R, class Flow, bool Strides = is_same<R, double> && !is_modal<Flow>>
struct view_of {
    using type = no_view;
};
template <class R, class Flow>
struct view_of<R, Flow, true> {
    using type = stride_view<R, Flow>;
};

// The terms that add up to the m-th derivative of a gap in free flight, within a step, are of the size
// rows[m] . |y| + gains[m]. Those terms are counted of which rows and y are sums themselves: there, too,
// large ones may have cancelled, and left their rounding.
template <int Dimension>
struct gap_terms {
    static constexpr int orders = 4;
    vec<double, Dimension> rows[orders];
    double gains[orders];
};

// A guard of an element in a mode: the state lasts while lower <= u <= upper. A constraint of the mode
// keeps a `held` one at zero: it says who may enter, and is not searched.
template <class R, int Dimension, int Orders>
struct watch {
    guard<R, Dimension, Orders> row;
    terms_of_derivative terms[plain_orders];
    int element;
    bool held;
    int reset;  // which map y takes where the limit is reached; -1: none
    int target; // code of the mode that follows; -1: decided by transition/elements.hpp
};
template <class R, int Dimension, int Orders, int Contacts, int Most>
struct watches {
    watch<R, Dimension, Orders> at[Most];
    int count;
    bool constrained;                     // whether entering the mode projects y
    gap_terms<Dimension> terms[Contacts]; // where the mode holds no contact closed
};
template <class R, int Dimension, int Orders, int Contacts>
struct watches<R, Dimension, Orders, Contacts, 0> {
    static constexpr int count = 0;
};

template <class R, class Flow, int Orders = taylor_order>
struct mode {
    using flow_type = Flow;
    static constexpr int dimension_limit = Flow::max_dimension;
    Flow flow;
    guard<R, dimension_limit, Orders> guards[Flow::max_contacts];
    [[no_unique_address]] watches<R, dimension_limit, Orders, Flow::max_contacts,
                                  Flow::shape_type::max_watches> watched;
    [[no_unique_address]] typename view_of<R, Flow>::type view;
    [[no_unique_address]] typename quick_of<R, Flow>::type quick; // where there are elements
};

// A mode is filled in by assemble.hpp, in memory as it is: most of its room is for larger systems, and never read.
template <class R, class Flow, int Orders>
VI_HD inline void begin_mode(mode<R, Flow, Orders>& m) {
    if constexpr (Flow::shape_type::max_watches > 0) {
        m.watched.count = 0;
        m.watched.constrained = false;
    }
    if constexpr (has_quick_modes<Flow>) m.quick.able = false;
}

// Whether the constraints of a mode keep the gap of a contact as it is, which needs no limits there.
template <class Mode>
VI_HD inline bool keeps_gap(const Mode& m, int contact) {
    const auto& g = m.guards[contact];
    return g.closed == no_side && !(g.lower > -infinity()) && !(g.upper < infinity());
}

inline constexpr double liveliest = 0.07; // as measured: more, and the wider spacing costs time

// Fills what the search for events reads, once flow and guards have their numbers: rounds are of the free mode.
template <class R, class Flow, int Orders>
VI_HD inline void prepare_search(mode<R, Flow, Orders>& m, bool free) {
    if constexpr (!is_modal<Flow>) {
        prepare_strides(m.view, m);
        if constexpr (has_quick_modes<Flow>)
            if (m.watched.count > 0) prepare_quick_mode(m.quick, m);
    } else if (free) {
        const int contacts = m.flow.contacts();
        R most = R(0.0);
        for (int i = 0; i < contacts; ++i)
            most = max(most, liveliness(m.guards[i], m.flow));
        if (most > liveliest) m.flow.set_spacing(lively_spacing);
        for (int i = 0; i < contacts; ++i)
            prepare_quick(m.guards[i], m.flow);
    }
}

// Affine change of coordinates y -> matrix y + shift.
template <int Dimension>
struct coordinate_map {
    vec<vec<double, Dimension>, Dimension> matrix;
    vec<double, Dimension> shift;

    template <class T>
    VI_HD constexpr vec<T, Dimension> operator()(const vec<T, Dimension>& y, int n) const {
        vec<T, Dimension> out = y;
        for (int i = 0; i < n; ++i)
            out[i] = dot(matrix[i], y, n, shift[i]);
        return out;
    }
};

// One contact in the free mode. u is pushed by a unit impulse along +u: y += impulse, and the rate
// of contact j changes by mobility[j].
template <class R, int Dimension, int Contacts>
struct contact_law {
    vec<R, Dimension> impulse;
    R mobility[Contacts];
    R effective_mass;        // 1 / mobility[i] of contact i itself
    vec<R, Dimension> shift; // displacement of y that moves u by mobility[i]
    R restitution_lower, restitution_upper;
};

VI_HD constexpr int whole_power(int base, int n) {
    int p = 1;
    for (int i = 0; i < n; ++i)
        p = base * p;
    return p;
}

// Law by which contacts that touch at one instant share an impact (transition/impact_law.hpp).
enum class impact_law { moreau, sequential };

// Elements, as all modes know them.
inline constexpr int radix = 7; // states of an element, at most
template <int Most>
struct element_table {
    bool given = false; // the mode that follows is given by the watch: a hybrid system as data
    int count = 0;
    int states[Most] = {}; // which it has: bit s for state s
    bool soft[Most] = {};  // meeting the upper (1) or the lower (2) stop is an impact
    bool joint[Most] = {}; // on massless coordinates: what it may do depends on the others
};
template <>
struct element_table<0> {
    static constexpr int count = 0;
    static constexpr bool given = false;
};

template <class Flow>
struct hybrid : sizes<typename Flow::shape_type> {
    static constexpr int max_dimension = Flow::max_dimension;
    static constexpr int max_contacts = Flow::max_contacts;
    using mode_type = mode<double, Flow>;
    using map_type = coordinate_map<max_dimension>;

    const mode_type* modes;    // modes[0] is free
    const map_type* from_free; // from_free[m]: free coordinates to those of mode m
    const map_type* to_free;
    const map_type* resets = nullptr; // of watches
    const int* codes;                 // codes[m]: which contacts mode m holds closed
    int mode_count;
    impact_law together = impact_law::moreau;
    contact_law<double, max_dimension, max_contacts> laws[max_contacts];
    gap_terms<max_dimension> terms[max_contacts]; // with elements the modes have them
    double inverse_omega_squared[max_lines];
    [[no_unique_address]] element_table<Flow::shape_type::max_elements> elements;

    // The mode with this code, or -1 if it has not been built.
    VI_HD constexpr int find_mode(int code) const {
        for (int m = 0; m < mode_count; ++m)
            if (codes[m] == code) return m;
        return -1;
    }

    // Codes of closed sets are below this; states of elements count in it.
    VI_HD constexpr int closed_sets() const { return whole_power(3, this->contacts()); }
    // Whether a mode holds no contact closed.
    VI_HD constexpr bool is_open(int mode) const {
        if constexpr (Flow::shape_type::max_elements == 0)
            return mode == 0;
        else
            return codes[mode] % closed_sets() == 0;
    }
};

// Terms of the gaps while elements are in the states that the motion is in: what else was built, or when, does
// not matter.
template <class Flow, class State>
VI_HD inline const gap_terms<Flow::max_dimension>* terms_in(const hybrid<Flow>& system,
                                                            const State& at) {
    if constexpr (Flow::shape_type::max_elements > 0) {
        const int open = system.find_mode(system.closed_sets() * at.elements.code);
        return system.modes[open < 0 ? 0 : open].watched.terms;
    } else {
        return system.terms;
    }
}

// The size of those terms where a motion stands, free coordinates.
template <class Flow, class State>
VI_HD inline double terms_of(const hybrid<Flow>& system, const State& at, int contact, int m) {
    const auto& y = at.y;
    const auto& terms = terms_in(system, at)[contact];
    const int n = system.dimension();
    double largest = 0.0, sum = terms.gains[m];
    for (int j = 0; j < n; ++j)
        largest = max(largest, abs(plain(y[j])));
    for (int j = 0; j < n;
         ++j) // a flow that is not modal leaves the rounding of the largest in all
        sum = sum + terms.rows[m][j] * (is_modal<Flow> ? abs(plain(y[j])) : largest);
    return sum;
}
inline constexpr double tie_margin = 64.0 * unit_roundoff; // of these terms is nothing but rounding

// sin^2 + cos^2 = 1, restored to first order after each flight.
template <class T, class Rates, int Dimension>
VI_HOT constexpr void renormalise_forcing(vec<T, Dimension>& y, int dimension, int lines,
                                          const Rates& inverse_omega_squared) {
    for (int l = 0; l < lines; ++l) {
        T& s = y[dimension - 2 * lines + 2 * l];
        T& c = y[dimension - 2 * lines + 2 * l + 1];
        const T norm = fma(s, s, c * c * inverse_omega_squared[l]);
        const T factor = fnma(0.5, norm, 1.5);
        s = s * factor;
        c = c * factor;
    }
}

} // namespace vi
