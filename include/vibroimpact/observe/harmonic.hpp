// Amplitude of the part of u = row . (x, v, a) + gain at a multiple k of the forcing frequency.
//
// Method      with w the frequency of the first line and T the length of the window,
//                 2 |integral of u exp(-i k w t)| / T                                          (1)
//             by the quadrature of rms.hpp, where u is a Taylor polynomial, in pieces of steps over which
//             k w t moves by 7/10 at most. The waves at the nodes of a piece are those at its middle,
//             turned: nodes of pieces of one length have the same turns.
// Assumes     forcing; zero without. Over whole turns of k w only that part of a periodic motion is left
// Accuracy    the integrand has rates up to twice the larger of k w and the fastest rate: the remainder is
//             that of rms.hpp; sums add one rounding per piece, k w times the rounding of times their phase
// Reference   rms.hpp
#pragma once

#include "vibroimpact/observe/rms.hpp"

namespace vi {

// (1), before it is divided.
class wave_integral {
public:
    VI_HD void begin(double rate, double origin) {
        rate_ = rate;
        origin_ = origin;
    }
    VI_HD double size() const { return sqrt(cosine_ * cosine_ + sine_ * sine_); }

    // Of u in a unit of time, over a span that begins at a time.
    VI_HD void include(const taylor_polynomial& u, double begin, double span, double unit) {
        const double pieces = 1.0 + floor(rate_ * span * (1.0 / most_turn));
        const double length = span / pieces, half = length / 2.0;
        turn_to(half);
        for (double k = 0.0; k < pieces; k = k + 1.0) {
            const double middle = k * length + half;
            const auto at = sincos(rate_ * ((begin - origin_) + middle));
            const auto u_at = [&](double x) { return evaluate(u, 0, (middle + half * x) / unit); };
            double even = gauss_centre.weight * u_at(0.0), odd = 0.0;
            for (int j = 0; j < 3; ++j) {
                const auto& g = gauss_pairs[j];
                const double before = u_at(-g.x), after = u_at(g.x);
                even = even + g.weight * ((before + after) * turns_[j].c);
                odd = odd + g.weight * ((after - before) * turns_[j].s);
            }
            cosine_ = cosine_ + half * (at.c * even - at.s * odd);
            sine_ = sine_ + half * (at.s * even + at.c * odd);
        }
    }

private:
    static constexpr double most_turn = 0.7; // of k w within a piece

    // Turns from the middle of a piece to its nodes.
    VI_HD void turn_to(double half) {
        if (half == half_) return;
        half_ = half;
        for (int j = 0; j < 3; ++j)
            turns_[j] = sincos(rate_ * (half * gauss_pairs[j].x));
    }

    double rate_ = 0.0, origin_ = 0.0, half_ = -1.0;
    sine_cosine<double> turns_[3];
    double cosine_ = 0.0, sine_ = 0.0; // integrals of u cos and u sin
};

namespace observe {

struct harmonic {
    static constexpr const char* name = "harmonic";
    static constexpr int most_rows = 16;
    row_list rows{};
    const double* harmonics = nullptr; // k of every row
    result_table amplitudes{};

    void options(const auto& to) {
        to.rows("rows", rows, most_rows);
        to.of_rows("harmonic", harmonics, rows, 0x1p-10, 0x1p10);
    }
    void tables(const batch_sizes&, const auto& to) { to("amplitudes", amplitudes, rows.count); }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct harmonic::observer {
    watched_rows<Flow> watched{};
    wave_integral of[most_rows];

    VI_HD void prepare(const harmonic& options, const member_start<Flow>& m) {
        for (int i = 0; i < watched.count; ++i)
            of[i].begin(options.harmonics[i] * m.omega, m.settle);
    }
    VI_HD void on_flight(const flight_segment<Flow>& s) {
        const auto* rows = watched.of_mode(s.mode);
        const auto& flow = s.system.modes[s.mode].flow;
        double begin = s.begin;
        march(s, [&](const auto& y, double span) {
            for (int i = 0; i < watched.count; ++i)
                of[i].include(detail::derivatives<taylor_order>(rows[i], y, flow), begin, span,
                              unit_of_time(flow.step));
            begin = begin + span;
        });
    }
    VI_HD void write(const auto& m, const harmonic& to) const {
        double* row = to.amplitudes.row(m.row);
        for (int k = 0; k < watched.count; ++k)
            row[k] = 2.0 * of[k].size() / m.duration;
    }
};

} // namespace observe
} // namespace vi
