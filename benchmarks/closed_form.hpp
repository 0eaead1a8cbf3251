// The impact damper as a researcher would write it: closed-form flight with libm, impact law.
//
// Flight    x1 = exp(-zeta omega_n t) (a cos(omega_d t) + b sin(omega_d t))
//                + A sin(omega t + tau),                                              (1)
//           x2 = x2(0) + v2 t,    u = x2 - x1,    contact at |u| = delta              (2)
// Impact    (1 + mu) v1+ = (1 - mu R) v1 + mu (1 + R) v2                              (3)
//           (1 + mu) v2+ = (1 + R) v1 + (mu - R) v2
// Assumes   0 <= zeta < 1 and no resonance.
#pragma once

#include <cmath>

#include "program.hpp"

namespace benchmark {

struct Oscillator {
    Parameters parameters;
    double decay, omega_d, amplitude, lag;
};

inline Oscillator oscillator(const Parameters& p) {
    const double stiff = p.omega_n * p.omega_n - p.omega * p.omega;
    const double damped = 2 * p.zeta * p.omega_n * p.omega;
    return {p, p.zeta * p.omega_n, p.omega_n * std::sqrt(1 - p.zeta * p.zeta),
            p.force / std::hypot(stiff, damped), std::atan2(damped, stiff)};
}

struct Motion {
    double u, v1, v2;
};

struct Flight {
    double decay, omega_d, a, b, amplitude, omega, tau, x2, v2;

    // u only: what a search samples.
    double distance(double t) const {
        const double transient = a * std::cos(omega_d * t) + b * std::sin(omega_d * t);
        return x2 + v2 * t - std::exp(-decay * t) * transient -
               amplitude * std::sin(omega * t + tau);
    }

    Motion motion(double t) const {
        const double c = std::cos(omega_d * t), s = std::sin(omega_d * t), e = std::exp(-decay * t);
        const double x1 = e * (a * c + b * s) + amplitude * std::sin(omega * t + tau);
        const double v1 = e * ((b * omega_d - a * decay) * c - (a * omega_d + b * decay) * s) +
                          amplitude * omega * std::cos(omega * t + tau);
        return {x2 + v2 * t - x1, v1, v2};
    }
};

inline Flight flight(const Oscillator& o, const Start& start) {
    const double tau = start.phase - o.lag, omega = o.parameters.omega;
    const double a = start.x1 - o.amplitude * std::sin(tau);
    const double forced = o.amplitude * omega * std::cos(tau);
    const double b = (start.v1 - forced + o.decay * a) / o.omega_d;
    return {o.decay, o.omega_d, a, b, o.amplitude, omega, tau, start.x2, start.v2};
}

// The state just after the impact at time t of a flight; the free mass is put on the stop exactly.
inline Start after_impact(const Parameters& p, const Flight& f, double phase, double t) {
    const double two_pi = 2 * std::acos(-1.0);
    const Motion m = f.motion(t);
    const double stop = m.u > 0 ? 1 : -1, x1 = f.x2 + f.v2 * t - m.u, mu = p.mass_ratio,
                 R = p.restitution;
    return {x1,
            x1 + stop * p.half_clearance,
            ((1 - mu * R) * m.v1 + mu * (1 + R) * m.v2) / (1 + mu),
            ((1 + R) * m.v1 + (mu - R) * m.v2) / (1 + mu),
            std::fmod(phase + p.omega * t, two_pi),
            stop};
}

// Flight, impact, flight ...; `first_contact(flight, start)` returns the time of the next contact
// or NaN.
template <class FirstContact>
void simulate(const Oscillator& o, Start start, std::size_t impacts, double* times,
              FirstContact first_contact) {
    double elapsed = 0;
    for (std::size_t k = 0; k < impacts; ++k) {
        const Flight f = flight(o, start);
        const double t = first_contact(f, start);
        if (std::isnan(t)) return;
        elapsed += t;
        times[k] = elapsed;
        start = after_impact(o.parameters, f, start.phase, t);
    }
}

} // namespace benchmark
