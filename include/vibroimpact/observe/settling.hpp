// When a motion has settled: the time from which on it stays within a tolerance of its orbit.
//
// Method      First run: a symbol (symbol.hpp) says how many impacts K the orbit has, and the last
//             impacts are kept. Second run, the same motion again from t = 0: impact i is compared
//             with the last kept impact j = i modulo K. The time of the last that differs in
//             contact, stop or state (state.hpp) is the settling time, 0 where none does.
// Assumes     both runs have the same impacts, to rounding where tangents are carried in the first
// Fails       NaN: not periodic, or K larger than `longest`
#pragma once

#include "vibroimpact/observe/symbol.hpp"

namespace vi::observe {

struct settling {
    static constexpr const char* name = "settling";
    symbol orbit{};
    long longest = 1;
    result_table time{};

    void options(const auto& to) {
        orbit.options(to);
        to.count("longest", longest, 1, largest_count);
    }
    void tables(const batch_sizes&, const auto& to) { to("time", time, 1); }
    long long borrows() const { return longest; }
    template <class Flow>
    struct observer;
    template <class Flow>
    struct comparison;
};

template <class Shape>
struct kept_impact {
    int contact, side;
    physical_state<Shape::max_dimension> state;
};

// First run.
template <class Flow>
struct settling::observer {
    using element = kept_impact<typename Flow::shape_type>;
    element* memory = nullptr; // room for `longest`
    symbol::observer<Flow> orbit{};
    long longest = 1, seen = 0;

    VI_HD void prepare(const settling& options, const member_start<Flow>& m) {
        orbit.prepare(options.orbit, m);
        longest = options.longest;
    }
    VI_HD void on_event(const event_view<Flow>& s) {
        if (!counts_as_impact(s.e.what)) return;
        orbit.on_event(s);
        memory[seen++ % longest] = {s.e.contact, s.e.side, physical(orbit.rows, s)};
    }
    VI_HD void write(const auto& m, const settling& to) const {
        const long period = orbit.result().impacts;
        double settled = not_a_number();
        if (period != 0 && period <= longest) {
            comparison<Flow> second{m.system, *this, period, m.impacts};
            m.run_again(second);
            settled = second.last_outside;
        }
        to.time.put(m.row, settled);
    }
};

// Second run; `impacts` is how many the first run had in all.
template <class Flow>
struct settling::comparison {
    using Shape = typename Flow::shape_type;
    const hybrid<Flow>& system;
    const observer<Flow>& first;
    long period, impacts;
    long count = 0;
    double last_outside = 0.0;

    VI_HD bool see(const event<double, Shape>& e, const trajectory<double, Shape>& at,
                   const clock& now) {
        if (!counts_as_impact(e.what)) return true;
        const auto& orbit = first.orbit;
        const long later = (impacts - ++count) / period * period; // to the end, whole periods
        const auto& there =
            first.memory[(first.seen - 1 - (impacts - count - later)) % first.longest];
        const auto here = physical(orbit.rows, event_view<Flow>{system, e, at, now.time()});
        if (there.contact != e.contact || there.side != e.side ||
            !same_state(there.state, here, orbit.rows, orbit.tolerance))
            last_outside = now.time();
        return true;
    }
};

} // namespace vi::observe
