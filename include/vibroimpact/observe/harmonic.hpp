// Amplitude of the part of u = row . (x, v, a) + gain at a multiple k of the forcing frequency.
//
// Method      with w the frequency of the first line and T the length of the window,
//                 2 |integral of u exp(-i k w t)| / T                                          (1)
//             by Gauss-Legendre quadrature with 12 nodes in every step, where u is a Taylor polynomial; in
//             pieces of it where k w t moves by more than 6.5. The waves at the nodes of a piece are those
//             at its middle, turned: nodes of pieces of one length have the same turns.
// Assumes     forcing; zero without. Over whole turns of k w only that part of a periodic motion is left
// Accuracy    The integrand has rates up to k w + W, W the fastest rate of the system, and W is at most 0.7 / h
//             on a step of length h: the remainder of 12 nodes on a piece of length h is
//                 h (12!)^4 / (25 (24!)^3) (6.5 + 0.7)^24 |u| < 4 10^-18 h |u|
//             below rounding; sums add one rounding per piece, and k w times the rounding of times.
// Reference   Abramowitz, Stegun, Handbook of Mathematical Functions, 25.4.30
#pragma once

#include "vibroimpact/observe/rms.hpp"

namespace vi {

// Nodes in [-1, 1] and weights; the others are mirror images.
inline constexpr int wave_pairs = 6;
inline constexpr gauss_node gauss_of_waves[wave_pairs] = {
    {0.12523340851146891547, 0.24914704581340278500},
    {0.36783149899818019375, 0.23349253653835480876},
    {0.58731795428661744730, 0.20316742672306592175},
    {0.76990267419430468704, 0.16007832854334622633},
    {0.90411725637047485668, 0.10693932599531843096},
    {0.98156063424671925069, 0.047175336386511827195}};

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
        const int pieces = 1 + static_cast<int>(rate_ * span * (1.0 / most_turn));
        const double length = span / pieces, half = length / 2.0;
        turn_to(half);
        for (int k = 0; k < pieces; ++k) {
            const double middle = k * length + half;
            const auto at = sincos(rate_ * ((begin - origin_) + middle));
            const auto u_at = [&](double x) { return evaluate(u, 0, (middle + half * x) / unit); };
            double even = 0.0, odd = 0.0;
            for (int j = 0; j < wave_pairs; ++j) {
                const auto& g = gauss_of_waves[j];
                const double before = u_at(-g.x), after = u_at(g.x);
                even = even + g.weight * ((before + after) * turns_[j].c);
                odd = odd + g.weight * ((after - before) * turns_[j].s);
            }
            cosine_ = cosine_ + half * (at.c * even - at.s * odd);
            sine_ = sine_ + half * (at.s * even + at.c * odd);
        }
    }

private:
    static constexpr double most_turn = 6.5; // of k w within a piece

    // Turns from the middle of a piece to its nodes.
    VI_HD void turn_to(double half) {
        if (half == half_) return;
        half_ = half;
        for (int j = 0; j < wave_pairs; ++j)
            turns_[j] = sincos(rate_ * (half * gauss_of_waves[j].x));
    }

    double rate_ = 0.0, origin_ = 0.0, half_ = -1.0;
    sine_cosine<double> turns_[wave_pairs];
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
