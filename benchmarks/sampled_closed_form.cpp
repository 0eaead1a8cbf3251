// The baseline: sample the closed form, bracket the first sign change, polish it.
//
// Method    u is evaluated at t = h, 2h, ..., h = forcing period / samples_per_period,
//           until |u| >= delta;                                                               (1)
//           the root in that step by Newton's method, by bisection where it leaves the step.  (2)
// Accuracy  |dt| <= 1e-14 max(1, t) for the root that was bracketed.
// Fails     two crossings inside one step leave no sign change: the contact is missed, silently.
#include "closed_form.hpp"

namespace {

using namespace benchmark;

constexpr double samples_per_period = 64;
constexpr double root_tolerance = 1e-14;

// (2); the gap is delta - |u|, positive just after `low`.
double polish(const Flight& f, double delta, double low, double high) {
    double t = 0.5 * (low + high);
    for (;;) {
        const Motion m = f.motion(t);
        const double side = m.u > 0 ? 1 : -1, gap = delta - side * m.u;
        (gap > 0 ? low : high) = t;
        double next = t + gap / (side * (m.v2 - m.v1));
        if (!(low < next && next < high)) next = 0.5 * (low + high);
        if (std::fabs(next - t) <= root_tolerance * std::fmax(1, t)) return next;
        t = next;
    }
}

double first_contact(const Flight& f, double delta, double step) {
    const long samples = static_cast<long>(longest_flight / step);
    for (long k = 1; k <= samples; ++k) { // (1)
        const double t = static_cast<double>(k) * step;
        if (std::fabs(f.distance(t)) >= delta) return polish(f, delta, t - step, t);
    }
    return none;
}

} // namespace

int main() {
    return run([](const Parameters& p) {
        const double step = 2 * std::acos(-1.0) / p.omega / samples_per_period;
        return [o = oscillator(p), step](const Start& start, std::size_t impacts, double* times) {
            simulate(o, start, impacts, times, [&](const Flight& f, const Start&) {
                return first_contact(f, o.parameters.half_clearance, step);
            });
        };
    });
}
