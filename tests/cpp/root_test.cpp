// Roots of Taylor polynomials where Newton's method alone goes round between two ends. Prints
// what fails, returns 1.
#include <cstdio>

#include "vibroimpact/event/first_root.hpp"

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

} // namespace

int main() {
    const bool left = a_cycle_is_left(), contact = a_contact_in_a_convex_window_is_found();
    return left && contact ? 0 : 1;
}
