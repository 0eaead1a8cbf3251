// A system put together from the numbers of its flows, guards and contacts.
//
// Method      numbers are copied, and what follows from them is filled in: propagators of a flow,
//             time derivatives of a row, 1 / mobility
// Assumes     row-major arrays, lent by the host; sizes of flows and systems are set
// Reference   hybrid.hpp says what the numbers mean; src/vibroimpact/hybrid.py makes them
#pragma once

#include "vibroimpact/hybrid.hpp"
#include "vibroimpact/mode_coordinates.hpp"

namespace vi {

struct flow_numbers {
    double step;
    const double *k = nullptr, *c = nullptr, *a = nullptr; // modal, one per block
    const double *b = nullptr, *constant = nullptr;        // dense
    const double *norm = nullptr, *growth = nullptr; // the same; without them it does not stride
};
struct guard_numbers {
    const double* row;
    double gain, lower, upper;
    int closed;
};
struct law_numbers {
    const double *impulse, *mobility, *shift;
    const double* restitution; // lower, upper
};

namespace detail {

VI_HD inline void copy(double* to, const double* from, int count) {
    for (int i = 0; i < count; ++i)
        to[i] = from[i];
}

VI_HD inline double finite_part(double x) {
    return abs(x) < infinity() ? abs(x) : 0.0;
}

} // namespace detail

template <class Flow>
VI_HD inline void set_flow(Flow& flow, const flow_numbers& from) {
    flow.step = from.step;
    if constexpr (is_modal<Flow>) {
        detail::copy(flow.k.x, from.k, flow.blocks());
        detail::copy(flow.c.x, from.c, flow.blocks());
        detail::copy(flow.a.x, from.a, flow.blocks());
    } else {
        const int n = flow.dimension();
        for (int i = 0; i < n; ++i)
            detail::copy(flow.b[i].x, from.b + i * n, n);
        detail::copy(flow.constant.x, from.constant, n);
        flow.growth = from.norm ? *from.growth : infinity();
        for (int i = 0; from.norm && i < n; ++i)
            detail::copy(flow.norm[i].x, from.norm + i * n, n);
    }
    flow.prepare();
}

template <int D, class Flow>
VI_HD inline void set_guard(guard<double, D>& g, const guard_numbers& from, const Flow& flow) {
    detail::copy(g.rows[0].x, from.row, flow.dimension());
    g.gains[0] = from.gain;
    g.lower = from.lower;
    g.upper = from.upper;
    g.closed = from.closed;
    g.reach = max(detail::finite_part(g.lower), detail::finite_part(g.upper));
    differentiate(g, flow);
}

// row . x as a row on the y of a mode, for observers.
template <int D, class Flow>
VI_HD inline void set_watched(guard<double, D>& g, const double* row, const mode_coordinates& p,
                              const Flow& flow) {
    const int n = flow.dimension();
    g = {};
    for (int i = 0; i < p.degrees; ++i) {
        for (int j = 0; j < n; ++j)
            g.rows[0][j] += row[i] * p.to_x[i * n + j];
        g.gains[0] += row[i] * p.offset[i];
    }
    differentiate(g, flow);
}

template <class Flow>
VI_HD inline void set_law(hybrid<Flow>& system, int contact, const law_numbers& from) {
    auto& law = system.laws[contact];
    detail::copy(law.impulse.x, from.impulse, system.dimension());
    detail::copy(law.mobility, from.mobility, system.contacts());
    law.effective_mass = 1.0 / law.mobility[contact];
    detail::copy(law.shift.x, from.shift, system.dimension());
    law.restitution_lower = from.restitution[0];
    law.restitution_upper = from.restitution[1];
}

template <class Flow>
VI_HD inline void set_lines(hybrid<Flow>& system, const double* kappas, int lines) {
    system.lines_ = lines;
    for (int l = 0; l < lines; ++l)
        system.inverse_omega_squared[l] = 1.0 / (kappas[l] * kappas[l]);
}

} // namespace vi
