// The rotation number of the section points: turns about a centre per point, in [0, 1/2].
//
// Method      Points are every stride-th impact at one stop (section.hpp), u_k their impact speeds.
//             Two central differences, in which a centre cancels,
//                 a_k = u_k+1 - u_k-1,   b_k = u_k+1 - 2 u_k + u_k-1                            (1)
//             are -2 r sin(2 pi rho) sin(f + 2 pi rho k) and -4 r sin^2(pi rho) cos(f + 2 pi rho k)
//             where u_k = c + r cos(f + 2 pi rho k): in quadrature, whatever rho is. With
//                 g = root mean square of a / that of b, over the first eighth of the window    (2)
//             the angle of (g b, a) turns from point to point by
//                 d_k = (angle_k - angle_k-1) / 2 pi,   taken in [-1/4, 3/4)                    (3)
//             and over the rest of the window, t the share of its time that has passed,
//                 rho = sum w(t_k) d_k / sum w(t_k),   w(t) = exp(-1 / (t (1 - t)))             (4)
//             folded to min(|rho|, 1 - |rho|). The error is the larger change of (4) to the same
//             average over either half, not below 2^-52.
// Assumes     (a, b) is, turned and stretched, the chord between neighbours in the plane of
//             (u_k, u_k+1). The points lie there on a closed curve that does not cross itself: its
//             chord turns once while its foot goes round once [hopf1935], however the curve bends
//             and wherever its centre is. So it is if u rises and falls once on the way round.
// Accuracy    (4) converges faster than any power of the number of points in smooth quasiperiodic
//             motion [das2017], and so it does with times that are not evenly spaced, t_k = k / N +
//             s_k / N, s_k quasiperiodic: expanded in 1 / N, all terms are integrals of derivatives
//             of w, which vanish at 0 and 1. p/q of a locked motion likewise; plain averages err by
//             1 / N. A motion that still spirals turns by the angle of its multiplier.
// Fails       NaN: fewer than `fewest` turns in a half; three speeds in a row agree within the
//             tolerance, as at a fixed point; a turn within 1/16 of an end of (3), so that a branch
//             of the angle cannot be told: chaos, or a curve that crosses itself. Of k curves that
//             the points visit in turn, or of k impacts per turn, the fraction of their order is
//             found; stride k looks at one of them.
// Reference   [das2017]; [hopf1935]: chords of closed curves
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

// (4): an average over times t in (0, 1).
struct bump_average {
    double sum = 0.0, weight = 0.0;
    long count = 0;

    VI_HD void include(double t, double value) {
        const double w = t > 0.0 && t < 1.0 ? exp(-1.0 / (t * (1.0 - t))) : 0.0;
        sum = sum + w * value;
        weight = weight + w;
        count += w > 0.0; // those that weigh
    }
    VI_HD double mean() const { return sum / weight; }
};

struct rotation {
    static constexpr const char* name = "rotation";
    long contact = 0, stride = 1;
    int stop = upper_side;
    double tolerance = 0.0;
    result_table number{}; // and its error

    void options(const auto& to) {
        to.count("stride", stride, 1, largest_count);
        to.count("contact", contact, 0, no_limit);
        to.stop("stop", stop);
        to.share("tolerance", tolerance);
    }
    void tables(const batch_sizes&, const auto& to) { to("number", number, 2); }
    template <class Flow>
    struct observer;
};

template <class Flow>
struct rotation::observer {
    static constexpr double measuring = 0.125;     // share of the window for (2)
    static constexpr double steepest = 0x1p6;      // g and 1 / g: a is rounding where u alternates
    static constexpr double lowest = -0.25;        // (3): the middle is that of [0, 1/2]
    static constexpr double clear = 0x1p-4;        // of both ends of (3)
    static constexpr double least_error = 0x1p-52; // rounding
    static constexpr long fewest = 8;

    rotation declared{};
    double settle = 0.0, length = 0.0; // the window

    long seen = 0, taken = 0;        // impacts at the stop, points
    double before = 0.0, last = 0.0; // speeds of two points
    double squares_a = 0.0, squares_b = 0.0;
    double g = 0.0; // 0: no angle yet
    double angle = 0.0;
    bool at_rest = false, torn = false;
    bump_average whole{}, halves[2];

    VI_HD void prepare(const rotation& options, const member_start<Flow>& m) {
        declared = options;
        settle = m.settle;
        length = m.observe;
    }
    VI_HD void on_event(const event_view<Flow>& s) {
        if (!counts_as_impact(s.e.what) || s.e.contact != declared.contact ||
            s.e.side != declared.stop)
            return;
        if (seen++ % declared.stride != 0) return;
        const double speed = abs(s.e.rate_before); // of completed chatter 0
        if (++taken > 2) look(speed, (s.time - settle) / length);
        before = last;
        last = speed;
    }

    VI_HD void write(const auto& m, const rotation& to) const {
        to.number.put(m.row, value(), error());
    }

private:
    VI_HD double value() const {
        const double rho = abs(whole.mean());
        return known() ? min(rho, 1.0 - rho) : not_a_number();
    }
    VI_HD double error() const {
        const double first = abs(halves[0].mean() - whole.mean());
        const double second = abs(halves[1].mean() - whole.mean());
        return known() ? max(max(first, second), least_error) : not_a_number();
    }
    VI_HD bool known() const {
        return !at_rest && !torn && halves[0].count >= fewest && halves[1].count >= fewest;
    }

    // The third of three speeds, when t of the window has passed.
    VI_HD void look(double next, double t) {
        const double a = next - before, b = (next - last) - (last - before); // (1)
        if (t < measuring) {
            squares_a = squares_a + a * a;
            squares_b = squares_b + b * b;
            return;
        }
        const double same = declared.tolerance * max(next, max(last, before));
        at_rest = at_rest || (abs(a) <= same && abs(b) <= same);
        const bool first = g == 0.0;
        if (first) g = ratio();
        const double from = angle;
        angle = atan2(a, g * b);
        if (!first) turn((angle - from) / (2.0 * pi), (t - measuring) / (1.0 - measuring));
    }

    VI_HD double ratio() const { // (2)
        if (squares_a == 0.0 && squares_b == 0.0) return 1.0;
        return max(min(sqrt(squares_a / squares_b), steepest), 1.0 / steepest);
    }

    VI_HD void turn(double d, double t) {
        d = d - floor(d - lowest); // (3)
        torn = torn || d < lowest + clear || d > lowest + 1.0 - clear;
        whole.include(t, d); // (4)
        const bool late = t >= 0.5;
        halves[late].include(2.0 * t - late, d);
    }
};

} // namespace vi::observe
