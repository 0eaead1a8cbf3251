// Impulse of every contact and element on the motion: the integral of its force, and the impulses of impacts;
// and the largest impulse of an impact.
//
// Method      Forces of part_forces.hpp, by the quadrature of rms.hpp. Impulses of impacts from what they do
//             to gap rates, A p = gamma+ - gamma, as in power.hpp; those of completed chatter likewise, from
//             the flight that it is completed by: its sum is that of all its impacts, none of which is the
//             largest.
// Assumes     where contacts are dependent only the sum of their impulses on the motion is determined: the
//             first ones carry it
// Accuracy    that of rms.hpp; chatter is summed to the accuracy of transition/rest.hpp
#pragma once

#include "vibroimpact/observe/part_forces.hpp"
#include "vibroimpact/observe/power.hpp"
#include "vibroimpact/observe/rms.hpp"

namespace vi::observe {

struct impulse {
    static constexpr const char* name = "impulse";
    result_table sums{};    // of every part along its row
    result_table largest{}; // of the impacts of every part; 0 without any

    void tables(const batch_sizes& n, const auto& to) {
        to("sums", sums, n.contacts + n.elements);
        to("largest", largest, n.contacts + n.elements);
    }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct impulse::observer {
    element_rows rows{};
    double sum[detail::most_parts<Flow>] = {}, most[detail::most_parts<Flow>] = {};
    vec<double, Flow::max_dimension> begin{}; // of the last flight, in the coordinates of its mode
    int mode = 0;
    double duration = 0.0;

    VI_HD void prepare(const impulse&, const member_start<Flow>& m) { rows = m.elements; }
    VI_HD void on_flight(const flight_segment<Flow>& s) {
        begin = s.y;
        mode = s.mode;
        duration = s.duration;
        detail::each_force(s, rows,
                           [&](int part, const taylor_polynomial& f, double span, double unit) {
                               integrals of;
                               of.include(f, span, unit);
                               sum[part] = sum[part] + of.first;
                           });
    }
    VI_HD void on_event(const event_view<Flow>& s) {
        if (s.e.what == status::impact || s.e.what == status::simultaneous)
            add(s, s.e.before, true);
        if (s.e.what != status::chatter) return;
        const auto y = s.system.modes[mode].flow.flight(begin, duration);
        add(s, s.system.is_open(mode) ? y : s.system.to_free[mode](y, s.system.dimension()), false);
    }
    VI_HD void write(const auto& m, const impulse& to) const {
        double* row = to.sums.row(m.row);
        for (long long k = 0; k < to.sums.width; ++k)
            row[k] = sum[k];
        for (long long i = 0; i < to.largest.width; ++i)
            to.largest.row(m.row)[i] = most[i];
    }

private:
    VI_HD void add(const event_view<Flow>& s, const vec<double, Flow::max_dimension>& before,
                   bool known) {
        const auto rates = detail::rates_of(s, before, known);
        const auto p = detail::through_inverse(rates.jump);
        for (int k = 0; k < rates.touching.count; ++k) {
            const int i = rates.touching.index[k];
            sum[i] = sum[i] - s.at.touching[i] * p[k];
            if (known) most[i] = max(most[i], p[k]);
        }
    }
};

} // namespace vi::observe
