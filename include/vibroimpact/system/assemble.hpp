// A system put together from the numbers of its flows, guards and contacts.
//
// Method      numbers are copied, and what follows from them is filled in: propagators of a flow,
//             time derivatives of a row, 1 / mobility
// Assumes     row-major arrays, lent by the host; sizes of flows and systems are set
// Reference   hybrid.hpp says what the numbers mean; src/vibroimpact/compile/hybrid.py makes them
#pragma once

#include "vibroimpact/system/hybrid.hpp"
#include "vibroimpact/system/mode_coordinates.hpp"

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
struct watch_numbers {
    guard_numbers guard;
    int element;
    bool held;
    int reset = -1, target = -1;
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
    if constexpr (is_modal<Flow>)
        set_own_size(g, flow);
    else
        prepare_reach(g, flow);
}

// The next watch of a mode.
template <class Mode>
VI_HD inline void add_watch(Mode& m, const watch_numbers& from) {
    if constexpr (Mode::flow_type::shape_type::max_watches > 0) {
        auto& to = m.watched.at[m.watched.count++];
        set_guard(to.row, from.guard, m.flow);
        for (int k = 0; k < plain_orders; ++k)
            to.terms[k] = terms_of_derivative(to.row, k, m.flow);
        to.element = from.element;
        to.held = from.held;
        to.reset = from.reset;
        to.target = from.target;
        m.watched.constrained = m.watched.constrained || from.held;
    }
}

// row . (x, v, a) as a row on the y of a mode, for observers: a = to_v (B y + b).
template <int D, class Flow>
VI_HD inline void set_observed_row(guard<double, D>& g, const double* row,
                                   const mode_coordinates& p, const Flow& flow) {
    const int n = flow.dimension();
    g = {};
    vec<double, D> moved{}; // row of the speed whose rate is the part in a
    bool accelerates = false;
    for (int i = 0; i < p.degrees; ++i) {
        const double x = row[i], v = row[p.degrees + i], a = row[2 * p.degrees + i];
        for (int j = 0; j < n; ++j) {
            g.rows[0][j] += x * p.to_x[i * n + j] + v * p.to_v[i * n + j];
            moved[j] += a * p.to_v[i * n + j];
        }
        g.gains[0] += x * p.offset[i];
        accelerates = accelerates || a != 0.0;
    }
    if (accelerates) {
        const auto rate = flow.next_row(moved);
        for (int j = 0; j < n; ++j)
            g.rows[0][j] += rate[j];
        g.gains[0] += flow.row_gain(moved);
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

namespace detail {

// |P| |P^-1| as a map of |y|, P being (2) of mode_coordinates.hpp: y comes from such terms.
template <int D>
VI_HD inline coordinate_map<D> terms_of_coordinates(const mode_coordinates& p, int n) {
    const int pairs = 2 * p.lines, first_line = n - pairs;
    coordinate_map<D> out{};
    for (int i = 0; i < first_line; ++i) {
        for (int k = 0; k < p.degrees; ++k) {
            const double x = abs(p.from_x[i * p.degrees + k]), v = abs(p.from_v[i * p.degrees + k]);
            for (int j = 0; j < n; ++j)
                out.matrix[i][j] += x * abs(p.to_x[k * n + j]) + v * abs(p.to_v[k * n + j]);
            out.shift[i] += x * (2.0 * abs(p.offset[k]));
        }
        for (int l = 0; l < pairs; ++l)
            out.matrix[i][first_line + l] += abs(p.particular[i * pairs + l]);
    }
    for (int l = first_line; l < n; ++l)
        out.matrix[l][l] = 1.0;
    return out;
}

// Terms of the derivative of what has these terms; returns those of its constant part.
template <int D, class Flow>
VI_HD inline double next_terms(const Flow& flow, const vec<double, D>& row, vec<double, D>& next) {
    const int n = flow.dimension();
    double gain = 0.0;
    next = {};
    for (int i = 0; i < n; ++i) {
        vec<double, D> unit{};
        unit[i] = 1.0;
        const auto part = flow.next_row(unit);
        for (int j = 0; j < n; ++j)
            next[j] += row[i] * abs(part[j]);
        gain += row[i] * abs(flow.row_gain(unit));
    }
    return gain;
}

} // namespace detail

// Of all gaps, from a mode that holds no contact closed.
template <class Flow>
VI_HD inline void set_terms(hybrid<Flow>& system, mode<double, Flow>& free,
                            const mode_coordinates& p) {
    constexpr int D = Flow::max_dimension;
    auto* terms = system.terms;
    if constexpr (Flow::shape_type::max_elements > 0) terms = free.watched.terms;
    const int n = free.flow.dimension();
    const auto of_y = detail::terms_of_coordinates<D>(p, n);
    for (int i = 0; i < free.flow.contacts(); ++i) {
        vec<double, D> row{}, next{};
        for (int k = 0; k < p.degrees; ++k) {
            double gradient = 0.0; // du / dx_k
            for (int j = 0; j < n; ++j)
                gradient += free.guards[i].rows[0][j] * p.from_x[j * p.degrees + k];
            for (int j = 0; j < n; ++j)
                row[j] += abs(gradient * p.to_x[k * n + j]);
        }
        gap_terms<D> to{};
        double gain = 0.0;
        for (int m = 0; m < gap_terms<D>::orders; ++m) {
            const double later = detail::next_terms(free.flow, row, next);
            to.rows[m] = {};
            to.gains[m] = gain + free.flow.step * later;
            for (int k = 0; k < n; ++k) {
                const double size = row[k] + free.flow.step * next[k];
                for (int j = 0; j < n; ++j)
                    to.rows[m][j] += size * of_y.matrix[k][j];
                to.gains[m] += size * of_y.shift[k];
            }
            row = next;
            gain = later;
        }
        terms[i] = to;
    }
}

template <class Flow>
VI_HD inline void set_lines(hybrid<Flow>& system, const double* kappas, int lines) {
    system.lines_ = lines;
    for (int l = 0; l < lines; ++l)
        system.inverse_omega_squared[l] = 1.0 / (kappas[l] * kappas[l]);
}

} // namespace vi
