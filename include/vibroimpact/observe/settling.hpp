// When a motion has settled: the time from which on it stays within a tolerance of its orbit.
//
// Method      First run: a symbol (symbol.hpp) says how many impacts K the orbit has, and the last
//             impacts are kept. Second run, the same motion again from t = 0: impact i is compared
//             with the last kept impact j = i modulo K. The time of the last that differs in
//             contact, stop or state (state.hpp) is the settling time, 0 where none does.
// Assumes     both runs have the same impacts, to rounding where tangents are carried in the first
// Fails       none(): not periodic, or K larger than `longest`
#pragma once

#include "vibroimpact/observe/symbol.hpp"

namespace vi {

template <class Shape>
struct kept_impact {
    int contact, side;
    physical_state<Shape::max_dimension> state;
};

// First run.
template <class Shape>
struct last_impacts {
    symbol<Shape> orbit{};
    long longest = 0;
    kept_impact<Shape>* kept = nullptr; // room for `longest`
    long seen = 0;

    template <class Flow>
    VI_HD void see(const scene<Flow>& s) {
        if (!counts_as_impact(s.e.what)) return;
        orbit.see(s);
        kept[seen % longest] = {s.e.contact, s.e.side, physical(orbit.rows, s)};
        ++seen;
    }
    VI_HD bool none() const {
        const int impacts = orbit.result().impacts;
        return impacts == 0 || impacts > longest;
    }
};

// Second run; `impacts` is how many the first run had in all.
template <class Flow>
struct settling {
    using Shape = typename Flow::shape_type;
    const hybrid<Flow>& system;
    const last_impacts<Shape>& orbit;
    long impacts;
    long count = 0;
    double last_outside = 0.0;

    VI_HD bool see(const event<double, Shape>& e, const trajectory<double, Shape>& at,
                   const clock& now) {
        if (!counts_as_impact(e.what)) return true;
        const long period = orbit.orbit.result().impacts;
        const long later = (impacts - ++count) / period * period; // to the end, whole periods
        const auto& there =
            orbit.kept[(orbit.seen - 1 - (impacts - count - later)) % orbit.longest];
        const auto here = physical(orbit.orbit.rows, scene<Flow>{system, e, at, now.time()});
        if (there.contact != e.contact || there.side != e.side ||
            !same_state(there.state, here, orbit.orbit.rows, orbit.orbit.tolerance))
            last_outside = now.time();
        return true;
    }
};

} // namespace vi
