// The closed form with libm and strides that cannot step over a contact.
//
// Method    |u''| <= M on the flight, M = sqrt(a^2 + b^2) omega_n^2 + A omega^2;            (1)
//           a gap g = delta -+ u stays positive up to the positive root s of
//           g + g' s - M s^2 / 2 = 0: stride by the smaller s of the two gaps,              (2)
//           until g <= contact_tolerance with g' < 0; then one Newton step.                 (3)
// Accuracy  that of the closed form; quadratic convergence to a simple root.
// Fails     not proved against rounding closer to grazing than contact_tolerance.
#include "closed_form.hpp"

namespace {

using namespace benchmark;

constexpr double contact_tolerance = 1e-13;

// (2)
double stride(double gap, double slope, double bound) {
    const double root = std::sqrt(slope * slope + 2 * bound * gap);
    return slope > 0 ? (slope + root) / bound : 2 * gap / (root - slope);
}

double first_contact(const Flight& f, const Start& start, double delta, double omega_n) {
    const double bound =
        std::hypot(f.a, f.b) * omega_n * omega_n + f.amplitude * f.omega * f.omega; // (1)
    double t = 0, u = start.contact != 0 ? start.contact * delta : start.x2 - start.x1;
    double du = start.v2 - start.v1;
    while (t < longest_flight) {
        t += std::fmin(stride(delta - u, -du, bound), stride(delta + u, du, bound));
        const Motion m = f.motion(t);
        u = m.u;
        du = m.v2 - m.v1;
        const double gap = delta - std::fabs(u), slope = u > 0 ? -du : du;
        if (gap <= contact_tolerance && slope < 0) return t - gap / slope; // (3)
        u = std::fmin(std::fmax(u, -delta), delta);
    }
    return none;
}

} // namespace

int main() {
    return run([](const Parameters& p) {
        return [o = oscillator(p)](const Start& start, std::size_t impacts, double* times) {
            simulate(o, start, impacts, times, [&](const Flight& f, const Start& from) {
                return first_contact(f, from, o.parameters.half_clearance, o.parameters.omega_n);
            });
        };
    });
}
