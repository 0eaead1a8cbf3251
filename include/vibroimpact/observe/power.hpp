// Kinetic energy lost in impacts.
//
// Method      gamma, gamma+ = gap rates of the contacts that touch, before and after; p = their
//             impulses along the gaps; A = mobility. With A p = gamma+ - gamma
//                 loss = T - T+ = -sum of p_i (gamma_i + gamma+_i) / 2                          (1)
//             One contact: (gamma^2 - gamma+^2) / (2 A), that is (1 - R^2) gamma^2 / (2 A).     (2)
// Assumes     where contacts are dependent A is singular but (1) is not: elimination skips the
//             contacts that the others determine
// Accuracy    what completed chatter still had to lose is neglected: by (3) of transition/rest.hpp it is
//             below 2^-53 of the motion's energy
// Reference   transition/impact_law.hpp
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi {

namespace detail {

// x of A x = b, A positive semidefinite and b in its range: zero where others determine it.
template <int N>
VI_HD inline vec<double, N> through_inverse(small_system<N> a) {
    constexpr double dependent = 0x1p-40; // what is left of a pivot: rounding
    double pivots[N] = {};
    vec<double, N> x{};
    for (int i = 0; i < a.n; ++i)
        pivots[i] = dependent * a.a[i][i];
    for (int i = 0; i < a.n; ++i) {
        if (!(a.a[i][i] > pivots[i])) continue;
        for (int r = i + 1; r < a.n; ++r) {
            const double factor = a.a[r][i] / a.a[i][i];
            for (int j = i; j < a.n; ++j)
                a.a[r][j] = a.a[r][j] - factor * a.a[i][j];
            a.b[r] = a.b[r] - factor * a.b[i];
        }
    }
    for (int i = a.n - 1; i >= 0; --i) {
        if (!(a.a[i][i] > pivots[i])) continue;
        double rest = a.b[i];
        for (int j = i + 1; j < a.n; ++j)
            rest = rest - a.a[i][j] * x[j];
        x[i] = rest / a.a[i][i];
    }
    return x;
}

// Effect of an event on the contacts that touch: A p = gamma+ - gamma, and gamma+ + gamma. `before` is the
// state before it; of the contact that it names the rate is known.
template <int N>
struct rates_of_impact {
    contact_list<N> touching{};
    small_system<N> jump{};
    vec<double, N> sum{};
};
template <class Flow>
VI_HD inline auto rates_of(const event_view<Flow>& s,
                           const vec<double, Flow::max_dimension>& before, bool known) {
    const auto& system = s.system;
    rates_of_impact<Flow::max_contacts> out;
    for (int i = 0; i < system.contacts(); ++i)
        if (s.at.touching[i] != 0.0) out.touching.add(i);
    out.jump = mobilities_of(system, s.at, out.touching);
    for (int k = 0; k < out.touching.count; ++k) {
        const int i = out.touching.index[k];
        const double rate = known && i == s.e.contact
                                ? s.e.rate_before
                                : -s.at.touching[i] * guard_value(system.modes[0].guards[i], 1,
                                                                  before, system.dimension());
        out.jump.b[k] = s.at.rate[i] - rate;
        out.sum[k] = s.at.rate[i] + rate;
    }
    return out;
}

// (1): add(contact, loss) for each that touches.
template <class Flow, class Add>
VI_HD inline void each_loss(const event_view<Flow>& s, const Add& add) {
    const auto r = rates_of(s, s.e.before, true);
    if (r.jump.n == 1) { // (2)
        const double loss = r.jump.b[0] * r.sum[0] * s.system.laws[s.e.contact].effective_mass;
        return add(s.e.contact, -0.5 * loss);
    }
    const auto p = through_inverse(r.jump);
    for (int k = r.jump.n - 1; k >= 0; --k)
        add(r.touching.index[k], -0.5 * (r.sum[k] * p[k]));
}

} // namespace detail

namespace observe {

struct power {
    static constexpr const char* name = "power";
    result_table loss{}, of_parts{}; // per unit of time, in all and of each part

    void tables(const batch_sizes& n, const auto& to) {
        to("loss", loss, 1);
        to("of_parts", of_parts, n.contacts + n.elements);
    }

    template <class Flow>
    struct observer {
        double lost = 0.0, at[detail::most_parts<Flow>] = {};

        VI_HD void on_event(const event_view<Flow>& s) {
            if (s.e.what != status::impact && s.e.what != status::simultaneous) return;
            double sum = 0.0;
            detail::each_loss(s, [&](int contact, double loss) {
                sum = sum + loss;
                at[contact] = at[contact] + loss;
            });
            lost = lost + sum;
        }
        VI_HD void write(const auto& m, const power& to) const {
            to.loss.put(m.row, lost / m.duration);
            for (long long i = 0; i < to.of_parts.width; ++i)
                to.of_parts.row(m.row)[i] = at[i] / m.duration;
        }
    };
};

} // namespace observe
} // namespace vi
