// A mode of a flow without blocks, as quick flights read it (search/grid/quick_flight.hpp).
//
// Method      Guards that are searched stand in a row, those of contacts first, then the watches of
//             elements: what is said of contacts there holds for all of them. A place of the grid,
//             at so many parts of a step, is reached by stored propagators of 1, 2 and 4 steps,
//             by the binary digits of the steps nearest to it, and by the Taylor series of what is left.
//             For the bound M >= |u''''| of search/grid/grid_bounds.hpp: with a(t) = row_4 exp(B t),
//               |a_j(t_k + s)| <= sum_m |(a(t_k) B^m)_j| h^m / m!,   0 <= s <= h             (1)
//             and the largest of these over all intervals of the grid times |y_j|.
// Assumes     |B| step <= 7/10, velocities being scaled; times of the wide grid are a step apart
// Accuracy    as flow/dense.hpp; (1) with a margin of 2^-30
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/system/guard.hpp"

namespace vi {

inline constexpr int longest_powers = 3; // propagators of 1, 2, 4 steps
// Terms from the nearest of these on, over half a step: (7/20)^14 / 14! < 2^-57.
inline constexpr int place_order = 13;

// Guards of a mode count as its contacts; they differ in number from mode to mode.
template <int Dimension, int Lines, int Guards, bool Exact>
struct guarded : shape<Dimension, Lines, Guards, Exact> {
    static constexpr bool exact_contacts = false;
};
template <class Shape>
using guarded_of =
    guarded<Shape::max_dimension, 0, Shape::max_contacts + Shape::max_watches, false>;

template <class R, class Shape>
struct quick_flow : sizes<Shape> {
    using shape_type = Shape;
    using real = R;
    static constexpr int max_dimension = Shape::max_dimension;
    static constexpr bool several_may_cross = true; // the watches of a mode often do
    template <class T>
    using state = vec<T, max_dimension>;
    struct propagator {
        vec<vec<R, max_dimension>, max_dimension> e;
        vec<R, max_dimension> shift;
    };

    propagator powers[longest_powers];
    vec<vec<R, max_dimension>, max_dimension> b;
    vec<R, max_dimension> constant;
    R step;
    R spacing[grids];
    R grid_error[grids];
    R scan_length;

    template <class Field>
    VI_HD void set_field(const Field& from) {
        b = from.b;
        constant = from.constant;
    }
    template <class Matrix>
    VI_HD void set_power(int k, int n, const Matrix& e, const vec<R, max_dimension>& shift) {
        powers[k].shift = shift;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                powers[k].e[i][j] = e[i][j];
    }

    VI_HOT R part() const { return step * (1.0 / parts_of_step); }
    template <class T>
    VI_HOT constexpr bool drifts(int) const {
        return false;
    }

    // Order terms of exp(B s) y by Horner's rule: y + s (y' + s/2 (y'' + ...)).
    template <int Order, class T, class Time>
    VI_HOT state<T> short_flight(const state<T>& y, const Time& s) const {
        state<T> rate, sum, next, out;
        turn(y, rate, [&](int i, const T& x) VI_WITHIN { return x + constant[i]; });
        this->each_coordinate([&](auto i) VI_WITHIN { sum[i] = rate[i]; });
        for (int m = Order; m >= 2; --m) {
            const Time part = s * (1.0 / m);
            turn(sum, next, [&](int i, const T& x) VI_WITHIN { return fma(x, part, rate[i]); });
            this->each_coordinate([&](auto i) VI_WITHIN { sum[i] = next[i]; });
        }
        this->each_coordinate([&](auto i) VI_WITHIN { out[i] = fma(sum[i], s, y[i]); });
        return out;
    }
    // Flow to second order, for the smallest s.
    template <class T, class Time>
    VI_HOT state<T> nudge(const state<T>& y, const Time& s) const {
        return short_flight<2>(y, s);
    }
    // exp(B place part) y, each lane at its own place.
    template <class T>
    VI_HOT state<T> apply_ahead(const R& place, const state<T>& y) const {
        const R steps = nearest(place * (1.0 / parts_of_step));
        R left = steps;
        state<T> out, next;
        this->each_coordinate([&](auto i) VI_WITHIN { out[i] = y[i]; });
        for (int m = longest_powers - 1; m >= 0; --m) {
            const double length = 1 << m;
            const mask_t<R> flown = left >= length;
            if (!any(flown)) continue;
            left = select(flown, left - length, left);
            apply(powers[m], out, next);
            this->each_coordinate([&](auto i)
                                      VI_WITHIN { out[i] = select(flown, next[i], out[i]); });
        }
        const R rest = fnma(steps, parts_of_step, place);
        return any(rest != 0.0) ? short_flight<place_order>(out, rest * part()) : out;
    }

    // row . y + c.
    template <class T, class C>
    VI_HOT T along(const vec<R, max_dimension>& row, const state<T>& y, const C& c) const {
        T sum = T(c);
        this->each_coordinate([&](auto j) VI_WITHIN { sum = fma(row[j], y[j], sum); });
        return sum;
    }

    // row . |y| + c.
    VI_HOT R bounded(const vec<R, max_dimension>& row, const state<R>& y, const R& c) const {
        R sum = c;
        this->each_coordinate([&](auto j) VI_WITHIN { sum = fma(row[j], abs(y[j]), sum); });
        return sum;
    }

private:
    // to = take(B y): a position moves by its own velocity, a line turns.
    template <class T, class Take>
    VI_HOT void turn(const state<T>& y, state<T>& to, const Take& take) const {
        this->each_oscillator([&](auto j) VI_WITHIN {
            to[2 * j] = take(2 * j, b[2 * j][2 * j + 1] * y[2 * j + 1]);
            to[2 * j + 1] = take(2 * j + 1, along(b[2 * j + 1], y, T(0.0)));
        });
        this->each_line([&](auto j) VI_WITHIN {
            to[2 * j] = take(2 * j, b[2 * j][2 * j + 1] * y[2 * j + 1]);
            to[2 * j + 1] = take(2 * j + 1, b[2 * j + 1][2 * j] * y[2 * j]);
        });
    }
    template <class T>
    VI_HOT void apply(const propagator& p, const state<T>& y, state<T>& to) const {
        this->each_oscillator([&](auto j) VI_WITHIN {
            to[2 * j] = along(p.e[2 * j], y, p.shift[2 * j]);
            to[2 * j + 1] = along(p.e[2 * j + 1], y, p.shift[2 * j + 1]);
        });
        this->each_line([&](auto j) VI_WITHIN {
            const T &sine = y[2 * j], &cosine = y[2 * j + 1];
            to[2 * j] = fma(p.e[2 * j][2 * j], sine, p.e[2 * j][2 * j + 1] * cosine);
            to[2 * j + 1] = fma(p.e[2 * j + 1][2 * j + 1], cosine, p.e[2 * j + 1][2 * j] * sine);
        });
    }
};

// A guard that is searched, with what grid_bounds.hpp bounds it by.
template <class R, class Shape>
struct quick_guard {
    static constexpr int orders = 3, D = Shape::max_dimension;
    vec<R, D> rows[orders + 1];
    R gains[orders + 1];
    rows_ahead<R, D> ahead[grids];
    vec<R, D> fourth;  // (1)
    vec<R, D> weights; // terms of u within a step, per |y_j|
    R least_fourth, least_terms;
    R lower, upper;
};

template <class R, class Shape>
struct quick_mode {
    using flow_type = quick_flow<R, Shape>;
    static constexpr bool in_lanes = true;
    flow_type flow;
    quick_guard<R, Shape> guards[Shape::max_contacts];
    int number[Shape::max_contacts]; // of each guard in the mode: contacts first, then watches
    bool able;                       // whether any flight can be quick

    VI_HD void set_guard(int i, const quick_guard<R, Shape>& from) { guards[i] = from; }
    VI_HD void fill_up() {}
};

// Guards are read as those of modal flows are.
template <class T, class R, class Shape, int D>
VI_HOT T guard_distance(const quick_guard<R, Shape>& g, const vec<T, D>& y,
                        const quick_flow<R, Shape>& flow) {
    return flow.along(g.rows[0], y, g.gains[0]);
}
template <class T, class R, class Shape, int D>
VI_HOT T guard_speed(const quick_guard<R, Shape>& g, const vec<T, D>& y,
                     const quick_flow<R, Shape>& flow) {
    return flow.along(g.rows[1], y, g.gains[1]);
}
template <class T, class R, class Shape, int D>
VI_HOT T guard_bend(const quick_guard<R, Shape>& g, const vec<T, D>& y,
                    const quick_flow<R, Shape>& flow) {
    return flow.along(g.rows[2], y, g.gains[2]);
}
template <class T, class R, class Shape, int D>
VI_HOT vec<T, 4> expand(const quick_guard<R, Shape>& g, const vec<T, D>& y,
                        const quick_flow<R, Shape>& flow) {
    return {flow.along(g.rows[0], y, g.gains[0]), flow.along(g.rows[1], y, g.gains[1]),
            0.5 * flow.along(g.rows[2], y, g.gains[2]),
            (1.0 / 6) * flow.along(g.rows[3], y, g.gains[3])};
}

namespace detail {

template <class R, class Shape, int D>
VI_HOT R terms_of(const quick_guard<R, Shape>& g, const quick_flow<R, Shape>& flow,
                  const vec<R, D>& y) {
    return flow.bounded(g.weights, y, g.least_terms);
}
template <class R, class Shape, int D>
VI_HOT R fourth_of(const quick_guard<R, Shape>& g, const quick_flow<R, Shape>& flow,
                   const vec<R, D>& y) {
    return flow.bounded(g.fourth, y, g.least_fourth);
}

// exp(B t), its entries as they are.
template <int D>
struct whole_propagator {
    vec<vec<double, D>, D> e;
    vec<double, D> shift;

    template <class Propagator>
    VI_HD whole_propagator(const Propagator& from, int n) : shift(from.shift) {
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                e[i][j] = from.entry(i, j);
    }
};

// A row times a propagator of another's flow, and the gain that comes with it.
template <int D>
VI_HD inline double row_before(const whole_propagator<D>& p, int n, double gain,
                               vec<double, D>& row) {
    vec<double, D> out;
    for (int i = 0; i < n; ++i)
        gain = gain + row[i] * p.shift[i];
    add_rows(row, p.e, n, out);
    for (int i = 0; i < n; ++i)
        row[i] = out[i];
    return gain;
}

// u along a grid: rows of u'' h^2, and of u at each of its times.
template <class Guard, class Propagator, int D>
VI_HD inline void set_rows_ahead(rows_ahead<double, D>& to, const Guard& g, const Propagator& once,
                                 int n, double h) {
    for (int j = 0; j < n; ++j)
        to.rows[j][0] = h * h * g.rows[2][j];
    to.gains[0] = h * h * g.gains[2];
    auto row = g.rows[0];
    double gain = g.gains[0];
    for (int k = 1; k <= grid_times; ++k) {
        gain = row_before(once, n, gain, row);
        for (int j = 0; j < n; ++j)
            to.rows[j][k] = row[j];
        to.gains[k] = gain;
    }
    to.shifted = false;
    for (double x : to.gains.x)
        to.shifted = to.shifted || x != 0.0;
}

// (1) along the wide grid.
template <class Shape, class Guard, class Flow, class Propagator>
VI_HD inline void set_fourth(quick_guard<double, Shape>& to, const Guard& g, const Flow& flow,
                             const Propagator& once, double h) {
    const int n = flow.dimension();
    const double unit = unit_of_time(flow.step);
    auto row = g.rows[4];
    double gain = g.gains[4];
    to.least_fourth = 0.0;
    to.fourth = {};
    for (int k = 0; k < grid_times; ++k) {
        auto next = row;
        double size = abs(gain), power = 1.0; // in units of time, as `next`
        vec<double, Shape::max_dimension> sizes{};
        for (int m = 0; m <= taylor_order; ++m) {
            for (int j = 0; j < n; ++j)
                sizes[j] = sizes[j] + power * abs(next[j]);
            power = power * (h / unit) / (m + 1.0);
            size = size + power * (unit * abs(flow.row_gain(next)));
            next = flow.next_row(next);
            for (int j = 0; j < n; ++j)
                next[j] = unit * next[j];
        }
        for (int j = 0; j < n; ++j)
            to.fourth[j] = max(to.fourth[j], (1.0 + proof_margin) * sizes[j]);
        to.least_fourth = max(to.least_fourth, (1.0 + proof_margin) * size);
        gain = row_before(once, n, gain, row);
    }
}

template <class Shape, class Guard, class Flow, class Propagator>
VI_HD inline void set_quick_guard(quick_guard<double, Shape>& to, const Guard& g, const Flow& flow,
                                  double h, const Propagator& once, const Propagator& part) {
    const int n = flow.dimension();
    for (int m = 0; m <= to.orders; ++m) {
        to.rows[m] = g.rows[m];
        to.gains[m] = g.gains[m];
    }
    set_rows_ahead(to.ahead[wide_grid], g, once, n, h);
    set_rows_ahead(to.ahead[narrow_grid], g, part, n, h / narrower);
    set_fourth(to, g, flow, once, h);
    to.lower = g.lower;
    to.upper = g.upper;
    to.least_terms = g.reach + (abs(g.gains[0]) + h * abs(g.gains[1]));
    for (int j = 0; j < n; ++j)
        to.weights[j] = abs(g.rows[0][j]) + h * abs(g.rows[1][j]);
}

// The least |D^-1 B D|, D scaling velocities by powers of two, and lines by so large a one that what they push is
// nothing.
template <class Flow>
VI_HD inline double scaled_norm(const Flow& flow) {
    const int n = flow.dimension(), first = n - 2 * flow.lines();
    double least = infinity(), speed = 0x1p-6;
    for (int v = 0; v <= 12; ++v, speed = 2.0 * speed) {
        const auto scale = [&](int i) { return i < first && i % 2 ? speed : 1.0; };
        double norm = 0.0;
        for (int i = 0; i < n; ++i) {
            double sum = 0.0;
            for (int j = i < first ? 0 : first; j < (i < first ? first : n); ++j)
                sum = sum + abs(flow.b[i][j]) * scale(j);
            norm = max(norm, sum / scale(i));
        }
        least = min(least, norm);
    }
    return least;
}

// The leading bits of a number, so that small multiples of it are exact.
VI_HD inline double leading_bits(double x) {
    return from_bits<double>(bits(x) >> 32 << 32);
}

// Whether positions move by their own velocities alone, and lines turn.
template <class Flow>
VI_HD inline bool is_plain(const Flow& flow) {
    const int n = flow.dimension(), first = n - 2 * flow.lines();
    bool plain = true;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const bool own = i % 2 == 0 ? j == i + 1 : i < first || j == i - 1;
            plain = plain && (own || flow.b[i][j] == 0.0);
        }
    for (int i = 0; i < n; i += 2)
        plain = plain && flow.constant[i] == 0.0;
    return plain;
}

} // namespace detail

// Fills what quick flights read of a mode, once its flow and guards have their numbers.
template <class Quick, class Mode>
VI_HD inline void prepare_quick_mode(Quick& to, const Mode& m) {
    using Shape = typename Quick::flow_type::shape_type;
    using propagator = detail::whole_propagator<Shape::max_dimension>;
    const auto& from = m.flow;
    auto& flow = to.flow;
    const int n = from.dimension(), contacts = from.contacts();
    int count = 0;
    to.able = detail::is_plain(from);
    for (int i = 0; i < contacts; ++i) {
        to.able = to.able && m.guards[i].closed == no_side;
        to.number[count++] = i;
    }
    for (int j = 0; j < m.watched.count; ++j)
        if (!m.watched.at[j].held) to.number[count++] = contacts + j;
    const double norm = detail::scaled_norm(from);
    to.able = to.able && count > 0 && norm > 0.0;
    static_cast<sizes<Shape>&>(flow) = {n, from.lines(), count, false};
    if (!(norm > 0.0) || (!to.able && !to.in_lanes)) return; // lanes have numbers of all modes
    flow.set_field(from);
    flow.step = detail::leading_bits(0.7 / norm);
    const double h = flow.step;
    auto power = from.at_time(h);
    const propagator once(power, n), narrow(from.at_time(h / narrower), n);
    for (int k = 0; k < longest_powers; ++k, power = from.after(power, power))
        flow.set_power(k, n, propagator(power, n).e, power.shift);
    for (int i = 0; i < grids; ++i) {
        const double apart = i == wide_grid ? h : h / narrower;
        flow.spacing[i] = i == wide_grid ? parts_of_step : parts_of_step / narrower;
        flow.grid_error[i] = 5.0 / 96 * (apart * apart) * (apart * apart);
    }
    flow.scan_length = grid_times * h;
    for (int i = 0; i < count; ++i) {
        const int j = to.number[i] - contacts;
        quick_guard<double, Shape> one;
        detail::set_quick_guard(one, j < 0 ? m.guards[j + contacts] : m.watched.at[j].row, from, h,
                                once, narrow);
        to.set_guard(i, one);
    }
    to.fill_up();
}

} // namespace vi
