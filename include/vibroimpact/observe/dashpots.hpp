// Power that dashpots take from the motion: the mean of v . C v, C the damping matrix of the mechanism.
//
// Method      the quadrature of rms.hpp in every step, where velocities are Taylor polynomials; dashpots of
//             elements are not in C, and have dissipation.hpp
// Accuracy    that of rms.hpp
#pragma once

#include "vibroimpact/observe/rms.hpp"

namespace vi::observe {

struct dashpots {
    static constexpr const char* name = "dashpots";
    row_list rows{};     // of velocities
    result_table work{}; // per unit of time

    void options(const auto& to) { to.velocities(rows); }
    void tables(const batch_sizes&, const auto& to) { to("work", work, 1); }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct dashpots::observer {
    static constexpr int most = Flow::max_dimension / 2;
    watched_rows<Flow> watched{};
    const double* damping = nullptr;
    double taken = 0.0;

    VI_HD void prepare(const dashpots&, const member_start<Flow>& m) { damping = m.damping; }
    VI_HD void on_flight(const flight_segment<Flow>& s) {
        const auto* rows = watched.of_mode(s.mode);
        const auto& flow = s.system.modes[s.mode].flow;
        march(s, [&](const auto& y, double span) {
            taylor_polynomial v[most];
            for (int i = 0; i < watched.count; ++i)
                v[i] = detail::derivatives<taylor_order>(rows[i], y, flow);
            double sum = 0.0;
            each_node(span / unit_of_time(flow.step),
                      [&](double t, double weight) { sum = sum + weight * power_at(v, t); });
            taken = taken + span / 2.0 * sum;
        });
    }
    VI_HD void write(const auto& m, const dashpots& to) const {
        to.work.put(m.row, taken / m.duration);
    }

private:
    // v . C v
    VI_HD double power_at(const taylor_polynomial* v, double t) const {
        double speed[most], power = 0.0;
        for (int i = 0; i < watched.count; ++i)
            speed[i] = evaluate(v[i], 0, t);
        for (int i = 0; i < watched.count; ++i) {
            double force = 0.0;
            for (int j = 0; j < watched.count; ++j)
                force = force + damping[i * watched.count + j] * speed[j];
            power = power + speed[i] * force;
        }
        return power;
    }
};

} // namespace vi::observe
