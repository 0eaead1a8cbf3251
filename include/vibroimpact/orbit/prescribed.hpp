// Motions with a prescribed sequence of impacts and changes of state, and the maps that they define.
//
// Method      Where the events and, nearly, their times are known, nothing has to be searched. With
//             zeta = (x, v, theta), theta the phase of the first forcing line, a flight of length t
//             in a mode and the crossing of a guard at its end are
//               y = exp(B t) y(zeta),  gap = row . y - limit,  y+ by (1) of restitution.hpp   (1)
//             analytic functions of zeta, t and the parameters, also where no motion runs so: the
//             gap need not be zero, and guards in between are not seen. Where an element changes its
//             state y does not jump, the impulse is zero; but for kicks at a phase, and resets of hybrid systems,
//             y <- A y + kick.
//             A return map solves gap = 0 for t: in jets, by Newton steps dt = -gap / rate from a
//             time whose value is right, each of which doubles the order that is right; a shift by
//             an infinitely small dt is a Taylor series that ends.                          (2)
//             Chatter is one segment: the impacts of one contact, from just after one of them until the
//             contact rests. Its length is no unknown, as it follows from the first state. From u = 0
//             at the rate u' the contact is back after the least t > 0 with
//               u' + u'' t/2 + u''' t^2/6 + ... = 0,                                     (3)
//             and leaves by (1); when the rate has fallen by 2^-28 (1 - r), r the restitution, a flight
//             of 2 u' / (-u'' (1 - r)) and a plastic impact end the sum ((1) of rest.hpp).
//             R = double: B is constant, its exponential is computed once. R = T: B carries the
//             derivatives with respect to a parameter.
// Assumes     one event at a time; flights within chatter of less than two steps; y = (x_i, v_i / rate)
//             in pairs, then the forcing pairs (sin, cos), in every mode
// Accuracy    that of dense_flow; times solve gap = 0 to the value they come with. What the sum leaves out
//             is below 2^-53 of the first flight in it
// Fails       (2) divides by the closing rate: infinite at grazing. NaN: what is no chatter, as the
//             contact does not come back, the flight in between is longer, or it takes 4096 impacts
// Reference   theory.md, "Periodic orbits"
#pragma once

#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/system/hybrid.hpp"
#include "vibroimpact/transition/restitution.hpp"

namespace vi {

// One side of one contact, where impacts or chatter end, or one limit of an element's guard.
template <class R, int Dimension>
struct stop {
    vec<R, Dimension> row; // on y
    R limit;
    vec<R, Dimension> impulse; // changes u' by one
    R restitution;
    vec<R, Dimension> kick; // by which y jumps besides
    bool chatters;
    const R* map =
        nullptr; // rows of a matrix by which y is multiplied before it; null: the unit matrix
};

inline constexpr int chatter_order = 20; // of its Taylor series: 1.4^20 / 20! < 2^-51
inline constexpr int most_chatter_impacts = 4096;
inline constexpr int most_root_steps = 60;

template <class T>
using orbit_state = vec<T, 2 * block_degrees + 1>; // x, v, theta

// States at the end of a flight of given length, before and after the impact.
template <class T>
struct arrival {
    T gap, rate, rate_after;
    orbit_state<T> before, after;
};

// Flights in one mode.
template <class R, class Shape>
struct prescribed {
    static constexpr int D = Shape::max_dimension;
    using field_type = linear_field<R, Shape>;
    using stop_type = stop<R, D>;
    template <class T>
    using state = vec<T, D>;

    field_type field;
    int degrees, lines;
    double rate;
    R omega;                   // of the first line, 0 where there is none
    double ratio[block_lines]; // of the other frequencies to it

    template <class T>
    VI_HD state<T> embed(const orbit_state<T>& z) const {
        state<T> y{};
        for (int i = 0; i < degrees; ++i) {
            y[2 * i] = z[i];
            y[2 * i + 1] = z[degrees + i] * (1.0 / rate);
        }
        for (int l = 0; l < lines; ++l) {
            const auto wave = sincos(z[2 * degrees] * ratio[l]);
            y[2 * (degrees + l)] = wave.s;
            y[2 * (degrees + l) + 1] = wave.c;
        }
        return y;
    }

    template <class T>
    VI_HD orbit_state<T> read(const state<T>& y, const T& theta) const {
        orbit_state<T> z{};
        for (int i = 0; i < degrees; ++i) {
            z[i] = y[2 * i];
            z[degrees + i] = y[2 * i + 1] * rate;
        }
        z[2 * degrees] = theta;
        return z;
    }

    template <class T>
    VI_HD T gap(const stop_type& s, const state<T>& y) const {
        return dot(s.row, y, field.dimension()) - s.limit;
    }
    template <class T>
    VI_HD T speed(const stop_type& s, const state<T>& y) const {
        return dot(s.row, field.derivative(y), field.dimension());
    }

    // A y of a stop that has a matrix.
    template <class T>
    VI_HD state<T> reset(const stop_type& s, const state<T>& y) const {
        const int n = field.dimension();
        state<T> after{};
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                after[i] = after[i] + y[j] * s.map[i * n + j];
        return after;
    }

    // (1) at the end y of a flight.
    template <class T>
    VI_HD arrival<T> cross_stop(const stop_type& s, const state<T>& y, const T& theta) const {
        arrival<T> a{gap(s, y), speed(s, y), T(0.0), read(y, theta), {}};
        const T p = rebound_of(a.rate, s.restitution).change; // A = 1
        state<T> after = y;
        for (int i = 0; i < field.dimension(); ++i)
            push(after[i], s.impulse[i], p);
        if (s.map) after = reset(s, after);
        for (int i = 0; i < field.dimension(); ++i)
            after[i] = after[i] + s.kick[i];
        a.rate_after = speed(s, after);
        a.after = read(after, theta);
        return a;
    }

    // y^(m) / m!, m = 0, ..., chatter_order
    template <class T>
    struct taylor_terms {
        state<T> at[chatter_order + 1];
        T gap[chatter_order + 1];
    };
    template <class T>
    VI_HD void expand(const stop_type& s, const state<T>& y, taylor_terms<T>& out) const {
        const int n = field.dimension();
        out.at[0] = y;
        out.at[1] = field.derivative(y);
        for (int m = 2; m <= chatter_order; ++m)
            for (int i = 0; i < n; ++i)
                out.at[m][i] = dot(field.b[i], out.at[m - 1], n) * (1.0 / m);
        for (int m = 1; m <= chatter_order; ++m)
            out.gap[m] = dot(s.row, out.at[m], n);
    }
    // The state, and the rate of the gap, after a time.
    template <class T>
    VI_HD T advance(const taylor_terms<T>& terms, const T& t, state<T>& y) const {
        for (int i = 0; i < field.dimension(); ++i) {
            T sum = terms.at[chatter_order][i];
            for (int m = chatter_order - 1; m >= 0; --m)
                sum = terms.at[m][i] + sum * t;
            y[i] = sum;
        }
        T rate = terms.gap[chatter_order] * double(chatter_order);
        for (int m = chatter_order - 1; m >= 1; --m)
            rate = terms.gap[m] * double(m) + rate * t;
        return rate;
    }
    // (3) by Newton's method from the parabola's root; NaN where it does not lead to a root.
    template <class T>
    VI_HD T next_return(const taylor_terms<T>& terms) const {
        T t = -(terms.gap[1] / terms.gap[2]);
        int settled = 0; // steps taken since the value is right, each of which doubles the order
        for (int step = 0; step < most_root_steps && settled < 3; ++step) {
            T f = terms.gap[chatter_order], slope(0.0);
            for (int m = chatter_order - 1; m >= 1; --m) {
                slope = f + slope * t;
                f = terms.gap[m] + f * t;
            }
            const T change = f / slope;
            t = t - change;
            if (abs(plain(change)) <= 0x1p-50 * abs(plain(t))) ++settled;
        }
        const double length = plain(t);
        return settled == 3 && length > 0.0 && length <= 2.0 * field.step ? t : T(not_a_number());
    }

    // Chatter from y, just after an impact: y becomes the state at rest; returns its duration.
    // Calls see(y, t) for each flight in it.
    template <class T, class See>
    VI_HD T chatter(const stop_type& s, state<T>& y, See see) const {
        const int n = field.dimension();
        const double lost = 1.0 - plain(s.restitution);
        auto strike = [&](const T& p) {
            for (int i = 0; i < n; ++i)
                push(y[i], s.impulse[i], p);
        };
        taylor_terms<T> terms;
        T elapsed(0.0);
        double first = 0.0;
        for (int impact = 0; impact < most_chatter_impacts; ++impact) {
            expand(s, y, terms);
            const double rate = abs(plain(terms.gap[1]));
            if (impact == 0) first = rate;
            if (rate <= 0x1p-28 * lost * first) {
                const T t = -(terms.gap[1] / (terms.gap[2] * (1.0 - s.restitution)));
                see(y, t);
                strike(advance(terms, t, y));
                return elapsed + t;
            }
            const T t = next_return(terms);
            if (!(plain(t) > 0.0)) break;
            see(y, t);
            const T closing = advance(terms, t, y);
            strike(rebound_of(closing, s.restitution).change);
            elapsed = elapsed + t;
        }
        return T(not_a_number());
    }
    // The same as a segment of length t, whose gap is t less the duration.
    template <class T>
    VI_HD arrival<T> end_chatter(const stop_type& s, const orbit_state<T>& z, const T& t) const {
        auto y = embed(z);
        const T time = chatter(s, y, [](const state<T>&, const T&) {});
        const auto after = read(y, z[2 * degrees] + time * omega);
        return {t - time, T(1.0), T(1.0), after, after};
    }

    // (1) after the time t + dt, dt infinitely small, e = exp(B t): exact to order Order of the jets.
    template <int Order, class T>
    VI_HD arrival<T> fly(const stop_type& s, const orbit_state<T>& z,
                         const typename field_type::propagator& e, const R& t, const T& dt) const {
        if (s.chatters) return end_chatter(s, z, dt + t);
        const auto y = field.apply(e, embed(z));
        return cross_stop(s, field.template short_flight<Order>(y, dt),
                          z[2 * degrees] + (dt + t) * omega);
    }

    // The impact at the end of a flight of about t, e = exp(B t): z becomes the state after it, and what comes
    // back is the infinitely small part of the time (2).
    template <int Order, class T>
    VI_HD T impact(const stop_type& s, orbit_state<T>& z, const typename field_type::propagator& e,
                   double t) const {
        if (s.chatters) {
            const auto a = end_chatter(s, z, T(t));
            z = a.after;
            return value(a.gap) - a.gap;
        }
        const auto y = field.apply(e, embed(z));
        T dt(0.0);
        for (int order = 0; order < Order; order = 2 * order + 1) {
            const auto at = field.template short_flight<Order>(y, dt);
            dt = dt - gap(s, at) / speed(s, at);
            dt = dt - value(dt);
        }
        z = cross_stop(s, field.template short_flight<Order>(y, dt),
                       z[2 * degrees] + (dt + t) * omega)
                .after;
        return dt;
    }

    // A flight of t + dt without an impact.
    template <int Order, class T>
    VI_HD void coast(orbit_state<T>& z, const typename field_type::propagator& e, double t,
                     const T& dt) const {
        const auto y = field.apply(e, embed(z));
        z = read(field.template short_flight<Order>(y, dt), z[2 * degrees] + (dt + t) * omega);
    }

    // Put the position or velocity j of z on a stop: u = limit. A guard of the phase alone has no
    // parameter, and z is on it.
    template <class T>
    VI_HD void put_on(const stop_type& s, orbit_state<T>& z, int j) const {
        if (j == 2 * degrees) return;
        z[j] = T(0.0);
        const R slope = j < degrees ? s.row[2 * j] : s.row[2 * (j - degrees) + 1] * (1.0 / rate);
        z[j] = -gap(s, embed(z)) / slope;
    }
};

} // namespace vi
