// First roots of Taylor polynomials: drawn at random, beside samples; and where Newton's method alone goes
// round between two ends. Prints what fails, returns 1.
#include <cstdio>
#include <random>

#include "vibroimpact/search/first_root.hpp"

namespace {

bool close(const char* name, double found, double expected) {
    if (vi::abs(found - expected) < 1e-14) return true;
    std::fprintf(stderr, "%s: %.17g, not %.17g\n", name, found, expected);
    return false;
}

// (s - 1)^3 - 5 (s - 1) on [0, 2]: from 2 Newton's step leads to 0, from 0 to 2.
bool a_cycle_is_left() {
    const vi::taylor_polynomial g{{4.0, -2.0, -6.0, 6.0}};
    return close("a cycle", vi::sign_change(g, 0, 0.0, 2.0), 1.0);
}

// 5/2 x^2 - x^4/4 - 1/2, x = s - 1: convex on [0, 2], its minimum -1/2 at 1 found from such a cycle.
bool a_contact_in_a_convex_window_is_found() {
    const vi::taylor_polynomial g{{1.75, -4.0, 2.0, 6.0, -6.0}};
    const auto found = vi::first_root(g, 2.0, 1e-12, false);
    return found.what == vi::finding::root &&
           close("a contact", found.s, 1.0 - vi::sqrt(5.0 - vi::sqrt(23.0)));
}

// Of a quartic: where it is first below zero, or that it is nowhere; one that comes nearer than samples show
// is left out.
bool a_first_root_is_where_samples_are_below_zero() {
    std::mt19937 numbers(7);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * (numbers() / 4294967296.0);
    };
    constexpr int samples = 1000, polynomials = 20000;
    int roots = 0, none = 0, wrong = 0;
    for (int i = 0; i < polynomials; ++i) {
        vi::taylor_polynomial g{{uniform(0.0, 1.0), uniform(-4.0, 4.0), uniform(-20.0, 20.0),
                                 uniform(-60.0, 60.0), uniform(-200.0, 200.0)}};
        double least = 1.0;
        int first = 0;
        for (int k = 1; k <= samples && first == 0; ++k) {
            const double u = vi::evaluate(g, 0, k / double(samples));
            least = vi::min(least, u);
            if (u < 0.0) first = k;
        }
        if (vi::abs(least) < 1e-4) continue;
        const auto found = vi::first_root(g, 1.0, 1e-12, false);
        const double s = found.s * samples;
        const bool right = first == 0
                               ? found.what == vi::finding::none
                               : found.what == vi::finding::root && s > first - 1.001 && s <= first;
        wrong += !right;
        (first == 0 ? none : roots) += 1;
    }
    if (wrong > 0) std::fprintf(stderr, "%d of %d roots\n", wrong, roots + none);
    return wrong == 0 && roots > polynomials / 4 && none > polynomials / 10;
}

// Minimum -/+ half of eps, and twice that: rounding, a contact, none.
bool a_minimum_within_eps_is_a_graze() {
    bool right = true;
    for (const double depth : {-2.0, -0.5, 0.5, 2.0}) {
        const double eps = 1e-9;
        const vi::taylor_polynomial g{{0.5 + depth * eps, -1.0, 1.0}}; // 1/2 (s - 1)^2 + depth
        const auto found = vi::first_root(g, 2.0, eps, false).what;
        right &= found == (depth < -1.0  ? vi::finding::root
                           : depth < 1.0 ? vi::finding::grazing
                                         : vi::finding::none);
    }
    if (!right) std::fprintf(stderr, "a minimum within eps\n");
    return right;
}

} // namespace

int main() {
    bool right = a_cycle_is_left();
    right &= a_contact_in_a_convex_window_is_found();
    right &= a_first_root_is_where_samples_are_below_zero();
    right &= a_minimum_within_eps_is_a_graze();
    return right ? 0 : 1;
}
