// The symbol n-p-q of a periodic motion, p and q of every contact, then of every element: a soft stop counts
// how often it is met.
//
// Method      The first impact in the window is the reference; a later one is a return if the motion
//             stands at the same contact and stop in the same state (state.hpp). The period is the
//             smallest K such that the impacts K, 2 K, 3 K, ... after the reference are all
//             returns, at least `returns` of them, to the end of the window.             (1)
//             Of these K impacts p are at the upper stop (A) of a contact, q at its lower one (B),
//             and n is the time of the first return in forcing periods, rounded: its phase agrees
//             already.
//             One bit per impact says whether it is a return; (1) is decided at the end.
// Assumes     completed chatter is one impact
// Fails       n = p = q = 0: no impact; not periodic, or not settled within the tolerance; period
//             too long for the window; K beyond the first 32 returns, or n beyond 16 bits.
//             The first 4096 impacts of a longer window decide. Without forcing n = 0.
#pragma once

#include "vibroimpact/observe/state.hpp"

namespace vi::observe {

template <int Stops>
struct periodic_symbol {
    int impacts = 0;
    int n = 0, p[Stops] = {}, q[Stops] = {};
};

struct symbol {
    static constexpr const char* name = "symbol";
    double tolerance = 0.0;
    long returns = 1;
    result_table numbers{}; // n, all p, all q

    void options(const auto& to) {
        to.share("tolerance", tolerance);
        to.count("returns", returns, 1, largest_count);
    }
    void tables(const batch_sizes& n, const auto& to) {
        to("numbers", numbers, 1 + 2 * (n.contacts + n.elements), 0.0);
    }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct symbol::observer {
    static constexpr int most_impacts = 4096, most_periods = 32, word = 64;
    static constexpr int too_long = -1;
    static constexpr double largest = 32767.0; // of n; p and q stay below most_impacts
    using repeated = periodic_symbol<Flow::max_contacts + Flow::shape_type::max_elements>;

    double tolerance = 0.0;
    long returns = 0;
    double omega = 0.0; // of the first forcing line; 0 without forcing
    physical_rows rows{};

    bool begun = false;
    int contact = 0, side = 0;
    double since = 0.0;
    physical_state<Flow::max_dimension> reference{};
    repeated after{}; // the reference
    unsigned long long returned[most_impacts / word] = {};
    repeated periods[most_periods]; // the first returns
    int candidates = 0;

    VI_HD void prepare(const symbol& options, const member_start<Flow>& m) {
        tolerance = options.tolerance;
        returns = options.returns;
        omega = m.omega;
        rows = {m.free, m.free.lines ? m.omega : 1.0 / m.step};
    }
    VI_HD void on_event(const event_view<Flow>& s) {
        if (!counts_as_impact(s.e.what)) return;
        if (!begun) {
            begun = true;
            contact = s.e.contact;
            side = s.e.side;
            since = s.time;
            reference = physical(rows, s);
            return;
        }
        if (after.impacts == most_impacts - 1) return;
        ++after.impacts;
        ++(s.e.side > 0 ? after.p : after.q)[s.e.contact];
        if (!is_back(s)) return;
        returned[after.impacts / word] |= 1ULL << (after.impacts % word);
        if (candidates == most_periods) return;
        const double elapsed = nearbyint((s.time - since) * omega / (2.0 * pi));
        after.n = elapsed <= largest ? static_cast<int>(elapsed) : too_long;
        periods[candidates++] = after;
    }

    VI_HD void write(const auto& m, const symbol& to) const {
        const auto found = result();
        double* row = to.numbers.row(m.row);
        const auto stops = (to.numbers.width - 1) / 2;
        row[0] = found.n;
        for (long long c = 0; c < stops; ++c) {
            row[1 + c] = found.p[c];
            row[1 + stops + c] = found.q[c];
        }
    }

    VI_HD repeated result() const {
        for (int i = 0; i < candidates; ++i)
            if (always_returns(periods[i].impacts))
                return periods[i].n == too_long ? repeated{} : periods[i];
        return {};
    }

private:
    VI_HD bool is_back(const event_view<Flow>& s) const {
        return s.e.contact == contact && s.e.side == side &&
               same_state(reference, physical(rows, s), rows, tolerance);
    }

    VI_HD bool always_returns(int k) const { // (1)
        for (int i = k; i <= after.impacts; i += k)
            if (!(returned[i / word] >> (i % word) & 1)) return false;
        return after.impacts / k >= returns;
    }
};

} // namespace vi::observe
