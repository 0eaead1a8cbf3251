// Motions with a prescribed sequence of impacts and changes of state, and the maps that they define.
//
// Method      Where the events and, nearly, their times are known, nothing has to be searched. With
//             zeta = (x, v, theta), theta the phase of the first forcing line, a flight of length t
//             in a mode and the crossing of a guard at its end are
//               y = exp(B t) y(zeta),  gap = row . y - limit,  y+ by (1) of restitution.hpp   (1)
//             analytic functions of zeta, t and the parameters, also where no motion runs so: the
//             gap need not be zero, and guards in between are not seen. Where an element changes its
//             state y does not jump, the impulse is zero; but for kicks at a phase.
//             A return map solves gap = 0 for t: in jets, by Newton steps dt = -gap / rate from a
//             time whose value is right, each of which doubles the order that is right; a shift by
//             an infinitely small dt is a Taylor series that ends.                          (2)
//             R = double: B is constant, its exponential is computed once. R = T: B carries the
//             derivatives with respect to a parameter.
// Assumes     one event at a time; y = (x_i, v_i / rate) in pairs, then the forcing pairs (sin, cos), in
//             every mode
// Accuracy    that of dense_flow; times solve gap = 0 to the value they come with
// Fails       (2) divides by the closing rate: infinite at grazing
// Reference   theory.md, "Periodic orbits"
#pragma once

#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/system/hybrid.hpp"
#include "vibroimpact/transition/restitution.hpp"

namespace vi {

// One side of one contact, or one limit of an element's guard.
template <class R, int Dimension>
struct stop {
    vec<R, Dimension> row; // on y
    R limit;
    vec<R, Dimension> impulse; // changes u' by one
    R restitution;
    vec<R, Dimension> kick; // by which y jumps besides
};

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

    // (1) at the end y of a flight.
    template <class T>
    VI_HD arrival<T> cross_stop(const stop_type& s, const state<T>& y, const T& theta) const {
        arrival<T> a{gap(s, y), speed(s, y), T(0.0), read(y, theta), {}};
        const T p = rebound_of(a.rate, s.restitution).change; // A = 1
        state<T> after = y;
        for (int i = 0; i < field.dimension(); ++i)
            push(after[i], s.impulse[i], p);
        for (int i = 0; i < field.dimension(); ++i)
            after[i] = after[i] + s.kick[i];
        a.rate_after = speed(s, after);
        a.after = read(after, theta);
        return a;
    }

    // (1) after the time t + dt, dt infinitely small, e = exp(B t): exact to order Order of the jets.
    template <int Order, class T>
    VI_HD arrival<T> fly(const stop_type& s, const orbit_state<T>& z,
                         const typename field_type::propagator& e, const R& t, const T& dt) const {
        const auto y = field.apply(e, embed(z));
        return cross_stop(s, field.template short_flight<Order>(y, dt),
                          z[2 * degrees] + (dt + t) * omega);
    }

    // The impact at the end of a flight of about t: z becomes the state after it, and what comes
    // back is the infinitely small part of the time (2).
    template <int Order, class T>
    VI_HD T impact(const stop_type& s, orbit_state<T>& z, double t) const {
        const auto y = field.apply(field.at_time(R(t)), embed(z));
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
    VI_HD void coast(orbit_state<T>& z, double t, const T& dt) const {
        const auto y = field.apply(field.at_time(R(t)), embed(z));
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
