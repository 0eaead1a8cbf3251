// The pace of a motion: how fast it meets stops or slips, where its machine does not say.
//
// Method      Of all parts u = row . x of a machine, stops and friction, the largest numbers are taken: s, the
//             speed of u at the start, relative to a belt; a, its acceleration by forces that do not
//             depend on the motion; d, the clearance of two stops; and l, the length that stops say, their
//             clearance, or the larger of the place of a stop and its distance, and s^2 / 2 a at least. Between
//             two stops, and under a force, stops are met again and again at the rate
//               p = max(s / d, sqrt(a / l)).                                               (1)
//             A machine with rates of its own keeps them up to `most`, and where the run is so long, T, that
//             p T > 2^17: then forces have moved it far beyond l, of which every place counts here.
//             Without any, a stop may also be met once, at s / l, where no step need be shorter than
//             T / 2^10; and p is at most 2^17 / T.                                           (2)
//             Rates of 2^-40 of (2) count as none in a run of T < 1 / rate, and in one without an end where no
//             line pushes more than constant forces: no motion notices them. Beside others p is at most
//             2^40 times these.                                                              (3)
//             Rounded down to a power of two, within the range of rates that can be searched.
// Accuracy    rounded to a power of two: other units of length and time, powers of two, move no digit
// Fails       zero where the machine's own rates serve, nothing is met, or no length is known
// Reference   src/vibroimpact/compile/pace.py says where it is used; theory.md, "Flight"
#pragma once

#include "vibroimpact/numeric/math.hpp"

namespace vi {

// One part; the row has n entries.
struct paced_part {
    const double* row;
    double lower, upper;      // places of stops, infinite where there is none
    double pull, lines, belt; // `lines` is the part of the pull that is theirs
};

inline constexpr double paces_of_run = 0x1p17, steps_of_run = 0x1p10, noticed = 0x1p-40;

// The largest numbers of the parts that are known.
struct paces {
    double speed = 0.0, pull = 0.0, clearance = 0.0, length = 0.0; // s, a, d, l
    double driven = 0.0;                                           // of a, by lines

    VI_HD void add(const paced_part& part, const double* x, const double* v, int n) {
        double u = 0.0, rate = 0.0;
        for (int j = 0; j < n; ++j) {
            u = u + part.row[j] * x[j];
            rate = rate + part.row[j] * v[j];
        }
        const double between = part.upper - part.lower;
        const bool both = between < infinity();
        if (both) clearance = max(clearance, between);
        speed = max(speed, abs(rate) + abs(part.belt));
        pull = max(pull, part.pull);
        driven = max(driven, part.lines);
        length = max(length, both ? between : max(way_to(part.lower, u), way_to(part.upper, u)));
    }

    // Pace of a machine with this rate of its own; `counted` is the length of the run where it counts.
    VI_HD double beside(double own, double size, double run, double counted) const {
        const double p = alone(run);
        const bool lasts = run < infinity() ? own * run > 1.0 : driven > 0.5 * pull;
        if (own <= noticed * p && !lasts) return p; // (3)
        return own > 0.0 ? vi::min(beside_rates(size, counted), own / noticed) : 0.0;
    }
    // Pace of a machine with rates of its own, (1); `size` is the largest |x_j|.
    VI_HD double beside_rates(double size, double run) const {
        const double l = thrown(max(length, size)), p = l > 0.0 ? again(l) : 0.0;
        return p * run <= paces_of_run ? p : 0.0;
    }
    // Pace of a machine without such rates, (2).
    VI_HD double alone(double run) const {
        const double l = thrown(length);
        if (!(l > 0.0 && l < infinity())) return 0.0;
        const double p = again(l);
        return p > 0.0 ? min(p, paces_of_run / run, run) : min(speed / l, steps_of_run / run, run);
    }

private:
    VI_HD double again(double l) const {
        return max(clearance > 0.0 ? speed / clearance : 0.0, sqrt(pull / l));
    }
    // A length, or how far the speed leads against the pull: a start on a stop is next to it by rounding only.
    VI_HD double thrown(double l) const {
        return pull > 0.0 ? max(l, speed * speed / (2.0 * pull)) : l;
    }
    // From where u is to a stop, or how far away that is.
    VI_HD static double way_to(double limit, double u) {
        return abs(limit) < infinity() ? max(abs(u - limit), abs(limit)) : 0.0;
    }
    // The smaller one, the second of a run that is not endless.
    VI_HD static double min(double p, double most, double run) {
        return run < infinity() && most < p ? most : p;
    }
};

// p rounded down to a power of two within the range; 0 is 0.
VI_HD inline double searchable(double p, double slowest, double fastest) {
    const double least = 2.0 * power_of_two_below(slowest), most = power_of_two_below(fastest);
    return p > 0.0 ? vi::min(vi::max(power_of_two_below(p), least), most) : 0.0;
}

} // namespace vi
