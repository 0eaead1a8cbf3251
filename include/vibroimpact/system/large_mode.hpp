// A mode of a larger flow without blocks, as the quick flights of one trajectory read it.
//
// Method      As quick_mode.hpp, but what stands side by side in a register are numbers of one trajectory: entries
//             of y, of which a product with a matrix takes a column at a time, and guards. So registers are full
//             whatever modes other trajectories are in. Arrays take the room that the sizes in use need, and
//             are filled up with zeros to whole registers of any target.
// Assumes     as quick_mode.hpp
// Accuracy    as quick_mode.hpp. Sums of entries of y add even and odd ones apart, as dot() does, in registers of
//             any size and in jets: equal bits
// Reference   theory.md, "Elements"
#pragma once

#include "vibroimpact/numeric/row_pack.hpp"
#include "vibroimpact/system/quick_mode.hpp"

namespace vi {

// A square matrix by columns, each filled up.
template <int D>
struct column_matrix {
    alignas(64) double numbers[D * filled(D)];

    VI_HD double at(int i, int j, int n) const { return numbers[j * filled(n) + i]; }

    template <class Entry>
    VI_HD void set(int n, const Entry& entry) {
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < filled(n); ++i)
                numbers[j * filled(n) + i] = i < n ? entry(i, j) : 0.0;
    }
    // to = start + this y; `start` and `to` are filled up.
    VI_HOT void apply(int n, const double* y, const double* start, double* to) const {
        constexpr int most = 3;
        const int apart = filled(n);
        int i = 0;
        for (; i + most * row_lanes <= apart; i += most * row_lanes)
            add_columns<most>(numbers + i, apart, y, n, start + i, to + i);
        for (; i < apart; i += row_lanes)
            add_columns<1>(numbers + i, apart, y, n, start + i, to + i);
    }
    template <class T>
    VI_HD void apply(int n, const T* y, const double* start, T* to) const {
        for (int i = 0; i < n; ++i) {
            T even = fma(at(i, 0, n), y[0], start[i]), odd = at(i, 1, n) * y[1];
            for (int j = 2; j < n; j += 2) {
                even = fma(at(i, j, n), y[j], even);
                odd = fma(at(i, j + 1, n), y[j + 1], odd);
            }
            to[i] = even + odd;
        }
    }
};

template <class Shape>
struct large_flow : sizes<Shape> {
    using shape_type = Shape;
    using real = double;
    static constexpr int max_dimension = Shape::max_dimension, room = filled(max_dimension);
    static constexpr bool several_may_cross = true; // the watches of a mode often do
    template <class T>
    using state = vec<T, max_dimension>;

    column_matrix<max_dimension> powers[longest_powers], b;
    double shifts[longest_powers][room], constant[room];
    double step, scan_length;
    double spacing[grids], grid_error[grids];

    template <class Field>
    VI_HD void set_field(const Field& from) {
        const int n = from.dimension();
        b.set(n, [&](int i, int j) { return from.b[i][j]; });
        fill_up(n, from.constant, constant);
    }
    template <class Matrix>
    VI_HD void set_power(int k, int n, const Matrix& e, const vec<double, max_dimension>& shift) {
        powers[k].set(n, [&](int i, int j) { return e[i][j]; });
        fill_up(n, shift, shifts[k]);
    }

    VI_HOT double part() const { return step * (1.0 / parts_of_step); }

    // Order terms of exp(B s) y by Horner's rule: y + s (y' + s/2 (y'' + ...)).
    template <int Order, class T, class Time>
    VI_HOT state<T> short_flight(const state<T>& y, const Time& s) const {
        static constexpr double zeros[room] = {};
        const int n = this->dimension();
        T rate[room], next[room], sum[room];
        b.apply(n, y.x, constant, rate);
        const T* last = rate;
        for (int m = Order; m >= 2; --m) {
            b.apply(n, last, zeros, next);
            add(rate, s * (1.0 / m), next, sum);
            last = sum;
        }
        state<T> out;
        for (int i = 0; i < n; ++i)
            out[i] = fma(last[i], s, y[i]);
        return out;
    }
    // Flow to second order, for the smallest s.
    template <class T, class Time>
    VI_HOT state<T> nudge(const state<T>& y, const Time& s) const {
        return short_flight<2>(y, s);
    }
    // exp(B place part) y.
    template <class T>
    VI_HOT state<T> apply_ahead(double place, const state<T>& y) const {
        const int n = this->dimension();
        const double steps = nearest(place * (1.0 / parts_of_step));
        double left = steps;
        state<T> out;
        T next[room];
        for (int i = 0; i < n; ++i)
            out[i] = y[i];
        for (int m = longest_powers - 1; m >= 0; --m) {
            const double length = 1 << m;
            if (!(left >= length)) continue;
            left = left - length;
            powers[m].apply(n, out.x, shifts[m], next);
            for (int i = 0; i < n; ++i)
                out[i] = next[i];
        }
        const double rest = fnma(steps, parts_of_step, place);
        return rest != 0.0 ? short_flight<place_order>(out, rest * part()) : out;
    }

private:
    VI_HD static void fill_up(int n, const vec<double, max_dimension>& from, double* to) {
        for (int i = 0; i < filled(n); ++i)
            to[i] = i < n ? from[i] : 0.0;
    }
    // to = from + x times.
    template <class T, class Time>
    VI_HOT void add(const T* from, const Time& x, const T* times, T* to) const {
        if constexpr (is_same<T, double>) {
            for (int i = 0; i < this->dimension(); i += row_lanes)
                store(to + i, fma(load(times + i), row_pack(x), load(from + i)));
        } else {
            for (int i = 0; i < this->dimension(); ++i)
                to[i] = fma(times[i], x, from[i]);
        }
    }
};

// A guard by itself, for the place where a flight ends on it: u, u', u'', u'''.
template <class Shape>
struct large_guard {
    static constexpr int orders = 3;
    vec<double, Shape::max_dimension> rows[orders + 1];
    double gains[orders + 1];
    double lower, upper;
};

// The guards that are searched, side by side: what belongs to entry j of y is in row j, as long as filled(count), of
// an array; of those at `times`, in row j times + k. Filled up by guards without limits.
template <class Shape>
struct guard_rows {
    static constexpr int D = Shape::max_dimension, most = filled(Shape::max_contacts);
    static constexpr int times = grid_times + 1;
    alignas(64) double rows[D * most], fourth[D * most], weights[D * most];
    double ahead[grids][D * times * most];
    double gains[most], least_fourth[most], least_terms[most], lower[most], upper[most];
    double ahead_gains[grids][times * most];

    // Guard number g of so many.
    VI_HD void set(int g, int count, int dimension, const quick_guard<double, Shape>& from) {
        const int apart = filled(count);
        for (int j = 0; j < dimension; ++j) {
            rows[j * apart + g] = from.rows[0][j];
            fourth[j * apart + g] = from.fourth[j];
            weights[j * apart + g] = from.weights[j];
        }
        for (int grid = 0; grid < grids; ++grid)
            for (int k = 0; k < times; ++k) {
                for (int j = 0; j < dimension; ++j)
                    ahead[grid][(j * times + k) * apart + g] = from.ahead[grid].rows[j][k];
                ahead_gains[grid][k * apart + g] = from.ahead[grid].gains[k];
            }
        gains[g] = from.gains[0];
        least_fourth[g] = from.least_fourth;
        least_terms[g] = from.least_terms;
        lower[g] = from.lower;
        upper[g] = from.upper;
    }
};

template <class Shape>
struct large_mode {
    using flow_type = large_flow<Shape>;
    static constexpr bool in_lanes = false;
    flow_type flow;
    large_guard<Shape> guards[Shape::max_contacts];
    guard_rows<Shape> all;
    int number[Shape::max_contacts]; // of each guard in the mode: contacts first, then watches
    bool able;                       // whether any flight can be quick

    VI_HD void set_guard(int i, const quick_guard<double, Shape>& from) {
        auto& to = guards[i];
        for (int m = 0; m <= to.orders; ++m) {
            to.rows[m] = from.rows[m];
            to.gains[m] = from.gains[m];
        }
        to.lower = from.lower;
        to.upper = from.upper;
        all.set(i, flow.contacts(), flow.dimension(), from);
    }
    // Guards are filled up once all have been set.
    VI_HD void fill_up() {
        quick_guard<double, Shape> none{};
        none.lower = -infinity();
        none.upper = infinity();
        for (int i = flow.contacts(); i < filled(flow.contacts()); ++i)
            all.set(i, flow.contacts(), flow.dimension(), none);
    }
};

// Guards are read as those of modal flows are.
template <class T, class Shape, int D>
VI_HOT T guard_distance(const large_guard<Shape>& g, const vec<T, D>& y,
                        const large_flow<Shape>& flow) {
    return dot(g.rows[0], y, flow.dimension(), g.gains[0]);
}
template <class T, class Shape, int D>
VI_HOT T guard_speed(const large_guard<Shape>& g, const vec<T, D>& y,
                     const large_flow<Shape>& flow) {
    return dot(g.rows[1], y, flow.dimension(), g.gains[1]);
}
template <class T, class Shape, int D>
VI_HOT T guard_bend(const large_guard<Shape>& g, const vec<T, D>& y,
                    const large_flow<Shape>& flow) {
    return dot(g.rows[2], y, flow.dimension(), g.gains[2]);
}
template <class T, class Shape, int D>
VI_HOT vec<T, 4> expand(const large_guard<Shape>& g, const vec<T, D>& y,
                        const large_flow<Shape>& flow) {
    return {guard_distance(g, y, flow), guard_speed(g, y, flow), 0.5 * guard_bend(g, y, flow),
            (1.0 / 6) * dot(g.rows[3], y, flow.dimension(), g.gains[3])};
}

// Whether a flow without blocks has modes of elements that are stored for quick flights: of a small one as packs of
// lanes read them, of another, whose arrays fill registers, for one trajectory.
inline constexpr int largest_of_lanes = 8;
template <class Flow>
inline constexpr bool is_of_lanes = Flow::max_dimension <= largest_of_lanes;
template <class Flow>
inline constexpr bool has_quick_modes = !is_modal<Flow> && Flow::shape_type::max_watches > 0;
struct no_quick_mode {};
template <class R, class Flow, bool Quick = has_quick_modes<Flow>, bool Lanes = is_of_lanes<Flow>>
struct quick_of {
    using type = no_quick_mode;
};
template <class R, class Flow>
struct quick_of<R, Flow, true, true> {
    using type = quick_mode<R, guarded_of<typename Flow::shape_type>>;
};
template <class Flow>
struct quick_of<double, Flow, true, false> {
    using type = large_mode<guarded_of<typename Flow::shape_type>>;
};

} // namespace vi
