// The symbol n-p-q of a periodic motion.
//
// Method      The first impact in the window is the reference; a later one is a return if the motion
//             stands at the same contact and stop in the same state (state.hpp). The period is the
//             smallest K such that the impacts K, 2 K, 3 K, ... after the reference are all
//             returns, at least `returns` of them, to the end of the window.             (1)
//             p of these K impacts are at upper stops (A), q at lower ones (B), and n is the time
//             of the first return in forcing periods, rounded: its phase agrees already.
//             One bit per impact says whether it is a return; (1) is decided at the end.
// Assumes     completed chatter is one impact
// Fails       n = p = q = 0: no impact; not periodic, or not settled within the tolerance; period
//             too long for the window; K beyond the first 32 returns, or n, p, q beyond 16 bits.
//             The first 4096 impacts of a longer window decide. Without forcing n = 0.
#pragma once

#include "vibroimpact/observe/state.hpp"

namespace vi {

struct periodic_symbol {
    int n = 0, p = 0, q = 0;
    VI_HD int impacts() const { return p + q; }
};

template <class Shape>
struct symbol {
    static constexpr int most_impacts = 4096, most_periods = 32, word = 64;
    static constexpr double largest = 32767.0; // of n, p, q
    struct period {
        int impacts, upper;
        double forcing_periods;
    };

    double tolerance = 0.0;
    long returns = 0;
    double omega = 0.0; // of the first forcing line; 0 without forcing
    physical_rows rows{};

    bool begun = false;
    int contact = 0, side = 0;
    double since = 0.0;
    physical_state<Shape::max_dimension> reference{};
    int impacts = 0, upper = 0; // after the reference; those at upper stops
    unsigned long long returned[most_impacts / word] = {};
    period periods[most_periods]; // the first returns
    int candidates = 0;

    template <class Flow>
    VI_HD void see(const scene<Flow>& s) {
        if (!counts_as_impact(s.e.what)) return;
        if (!begun) {
            begun = true;
            contact = s.e.contact;
            side = s.e.side;
            since = s.time;
            reference = physical(rows, s);
            return;
        }
        if (impacts == most_impacts - 1) return;
        ++impacts;
        upper += s.e.side > 0;
        if (!is_back(s)) return;
        returned[impacts / word] |= 1ULL << (impacts % word);
        if (candidates == most_periods) return;
        const double elapsed = (s.time - since) * omega / (2.0 * pi);
        periods[candidates++] = {impacts, upper, nearbyint(elapsed)};
    }

    VI_HD periodic_symbol result() const {
        for (int i = 0; i < candidates; ++i)
            if (always_returns(periods[i].impacts)) {
                const auto& k = periods[i];
                if (max(k.forcing_periods, static_cast<double>(k.impacts)) > largest) return {};
                return {static_cast<int>(k.forcing_periods), k.upper, k.impacts - k.upper};
            }
        return {};
    }

private:
    template <class Flow>
    VI_HD bool is_back(const scene<Flow>& s) const {
        return s.e.contact == contact && s.e.side == side &&
               same_state(reference, physical(rows, s), rows, tolerance);
    }

    VI_HD bool always_returns(int k) const { // (1)
        for (int i = k; i <= impacts; i += k)
            if (!(returned[i / word] >> (i % word) & 1)) return false;
        return impacts / k >= returns;
    }
};

} // namespace vi
