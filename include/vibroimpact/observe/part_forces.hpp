// Forces of all contacts and elements along a flight, as Taylor polynomials of its steps.
//
// Method      A contact that is closed has the row of its force as guard, positive where it presses; along
//             its own row the force is -side times that. Forces of elements are rows on (y, 1), lent by
//             the host. Along a flight y' = B y + b the derivatives of a row are those of y:
//                 y^(m) = B^(m-1) (B y + b),   f^(m) = row . y^(m)                             (1)
//             in units of time (flow/series.hpp).
// Accuracy    that of search/polynomial.hpp
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::detail {

// (1)
template <class Flow>
class state_derivatives {
public:
    VI_HD state_derivatives(const Flow& flow, const vec<double, Flow::max_dimension>& y)
        : n_(flow.dimension()) {
        y_[0] = y;
        const double unit = unit_of_time(flow.step);
        y_[1] = flow.derivative(y);
        for (int i = 0; i < n_; ++i)
            y_[1][i] = unit * y_[1][i];
        for (int m = 1; m < taylor_order; ++m)
            for (int i = 0; i < n_; ++i)
                y_[m + 1][i] = unit * dot(flow.b[i], y_[m], n_);
    }
    // Series of a row on (y, 1).
    VI_HD taylor_polynomial of(const double* row) const {
        taylor_polynomial out{};
        for (int m = 0; m <= taylor_order; ++m) {
            double sum = m == 0 ? row[n_] : 0.0;
            for (int i = 0; i < n_; ++i)
                sum = sum + row[i] * y_[m][i];
            out.d[m] = sum;
        }
        return out;
    }
    VI_HD bool is_zero(const double* row) const {
        for (int i = 0; i <= n_; ++i)
            if (row[i] != 0.0) return false;
        return true;
    }

private:
    int n_;
    vec<double, Flow::max_dimension> y_[taylor_order + 1];
};

// act(part, f, span, unit) in every step of a flight for every part whose force is not zero in its mode: contacts,
// then elements, as events number them; `unit` is that of the time of f.
template <class Flow, class Act>
VI_HD inline void each_force(const flight_segment<Flow>& s, const element_rows& rows,
                             const Act& act) {
    const auto& mode = s.system.modes[s.mode];
    const int contacts = s.system.contacts();
    const double unit = unit_of_time(mode.flow.step);
    bool some = rows.elements > 0;
    for (int i = 0; i < contacts; ++i)
        some = some || mode.guards[i].closed != no_side;
    if (!some) return;
    march(s, [&](const auto& y, double span) {
        for (int i = 0; i < contacts; ++i) {
            if (mode.guards[i].closed == no_side) continue;
            auto f = derivatives<taylor_order>(mode.guards[i], y, mode.flow);
            for (double& d : f.d)
                d = -mode.guards[i].closed * d;
            act(i, f, span, unit);
        }
        if constexpr (Flow::shape_type::max_elements > 0) {
            if (rows.elements == 0) return;
            const state_derivatives<Flow> at(mode.flow, y);
            for (int e = 0; e < rows.elements; ++e)
                if (const double* row = rows.force(s.mode, e); !at.is_zero(row))
                    act(contacts + e, at.of(row), span, unit);
        }
    });
}

} // namespace vi::detail
