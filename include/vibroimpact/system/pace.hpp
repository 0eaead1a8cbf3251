// The pace of a motion: how fast it meets stops or slips, where its machine does not say.
//
// Method      Of all parts u = row . x of a machine, stops and friction, the largest numbers are taken: s, the
//             speed of u at the start, relative to a belt; a, its acceleration by forces that do not
//             depend on the motion; d, the clearance of two stops; and the length
//               l = max(what the stops say, s^2 / 2 a),                                    (1)
//             stops saying their clearance, or the larger of the place of a stop and its distance. Between
//             two stops, and under a force, stops are met again and again at the rate
//               p = max(s / d, sqrt(a / l)).                                               (2)
//             It is the pace where it is above `most`, up to which the machine's own rates serve.
//             A machine that has none at all may still meet a stop once, at p = s / l; in a run of length T a step
//             need not be shorter for that than
//               p = min(s / l, 2^10 / T).                                                  (3)
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
    double lower, upper; // places of stops, infinite where there is none
    double pull, belt;
};

// The largest numbers of the parts that are known.
struct paces {
    double speed = 0.0, pull = 0.0, clearance = 0.0, length = 0.0; // s, a, d, l

    VI_HD void add(const paced_part& part, const double* x, const double* v, int n) {
        double u = 0.0, rate = 0.0;
        for (int j = 0; j < n; ++j) {
            u = u + part.row[j] * x[j];
            rate = rate + part.row[j] * v[j];
        }
        speed = max(speed, abs(rate) + abs(part.belt));
        pull = max(pull, part.pull);
        const double between = part.upper - part.lower;
        if (between < infinity()) clearance = max(clearance, between);
        length =
            max(length,
                between < infinity() ? between : max(way_to(part.lower, u), way_to(part.upper, u)));
    }

    VI_HD double pace(double most, double run, double slowest, double fastest) const {
        const double l = pull > 0.0 ? max(length, speed * speed / (2.0 * pull)) : length; // (1)
        if (!(l > 0.0 && l < infinity())) return 0.0;
        const double again = max(clearance > 0.0 ? speed / clearance : 0.0, sqrt(pull / l)); // (2)
        const double once =
            run < infinity() ? min(speed / l, steps_of_run / run) : speed / l; // (3)
        const double p = again > 0.0 || most > 0.0 ? again : once;
        const double found = min(max(below(p), above(slowest)), below(fastest));
        return p > 0.0 && found > most ? found : 0.0;
    }

private:
    static constexpr double steps_of_run = 1024.0;
    // From where u is to a stop, or how far away that is.
    VI_HD static double way_to(double limit, double u) {
        return abs(limit) < infinity() ? max(abs(u - limit), abs(limit)) : 0.0;
    }
    // The power of two that x > 0 is rounded down to, or up.
    VI_HD static double below(double x) { return from_bits<double>(bits(x) >> 52 << 52); }
    VI_HD static double above(double x) { return 2.0 * below(x); }
};

} // namespace vi
