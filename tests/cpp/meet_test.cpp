// What is said of one interval, beside curves that may be there: the cubic through the ends with the given
// second differences, and as much more as the slack allows. Prints what fails, returns 1.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drawn_flow.hpp"
#include "vibroimpact/search/grid/grid_bounds.hpp"

namespace {

using drawn::uniform;
constexpr int samples = 400, curves = 8;

struct stops {
    double lower, upper;
};
using drawn_interval = vi::detail::open_interval<double>;

// u'' = D_0 + (D_1 - D_0) x, and e before x = turn, -e after it.
struct curve {
    vi::detail::interval<double> u;
    double e, turn;

    // Twice integrated, both from zero.
    double pushed(double x) const {
        const double after = std::max(x - turn, 0.0);
        return e * (0.5 * x * x - after * after);
    }
    double at(double x) const {
        const double bend0 = u.last - 2.0 * u.first + u.before;
        const double bend1 = u.after - 2.0 * u.last + u.first;
        const double cubic = u.first + x * (u.last - u.first) -
                             x * (1.0 - x) / 6.0 * ((2.0 - x) * bend0 + (1.0 + x) * bend1);
        return cubic + pushed(x) - x * pushed(1.0);
    }
};

struct tally {
    int meetings = 0, crossings = 0, returns = 0, clear = 0, wrong = 0, far = 0;
};

struct passage {
    int changes = 0;     // between the stops and not
    bool beyond = false; // past a stop at the end
    double side = 0.0;   // of that one
    double first = 1.0;  // where it is past one first
};
passage follow(const curve& c, const stops& g) {
    passage out;
    for (int i = 1; i <= samples; ++i) {
        const double x = i / double(samples), y = c.at(x);
        const bool beyond = y >= g.upper || y <= g.lower;
        if (beyond) out.side = y >= g.upper ? 1.0 : -1.0;
        if (beyond && out.changes == 0) out.first = x;
        out.changes += beyond != out.beyond;
        out.beyond = beyond;
    }
    return out;
}

// Whether a curve leaves the stop that it begins on, if it does: others are no flights.
bool leaves(const curve& c, const stops& g) {
    const double y = c.at(1e-6);
    return y < g.upper && y > g.lower;
}

void check(const drawn_interval& at, const stops& g, tally& all) {
    const curve middle{at.u, 0.0, 1.0};
    if (!leaves(middle, g)) return;
    vi::detail::scan_result<double> s{};
    s.length = 12.0;
    const auto met = vi::detail::meet(g, 0, at, s);
    for (int i = 0; i < curves; ++i) {
        const double e = (i % 2 ? -4.0 : 4.0) * at.apart.slack;
        const curve c{at.u, e, i < 2 ? 1.0 : uniform(0.0, 1.0)};
        if (!leaves(c, g)) continue;
        const auto seen = follow(c, g);
        if (met.clear && seen.changes > 0) ++all.wrong;
        if (met.crosses && (seen.changes != 1 || seen.side != s.stop.side)) ++all.wrong;
    }
    if (met.back && std::fabs(s.place / s.length - follow(middle, g).first) > 0.01) ++all.far;
    ++all.meetings;
    all.crossings += met.crosses;
    all.returns += met.back;
    all.clear += met.clear;
}

// From just below a stop to just beyond it, in units of the slack: where that decides.
drawn_interval draw_close(const stops& g) {
    drawn_interval at{};
    const double slack = std::pow(10.0, uniform(-4.0, -1.0));
    at.apart.slack = slack;
    at.u.first = g.upper - uniform(0.0, 1.0) * slack;
    at.u.last = g.upper + uniform(0.0, 1.0) * slack;
    at.u.before = 2.0 * at.u.first - at.u.last + uniform(-6.0, 6.0) * slack;
    at.u.after = 2.0 * at.u.last - at.u.first + uniform(-6.0, 6.0) * slack;
    return at;
}

// Ends and differences of all kinds; half of them begin on a stop.
drawn_interval draw(const stops& g) {
    if (uniform(0.0, 1.0) < 0.25) return draw_close(g);
    drawn_interval at{};
    const double kind = uniform(0.0, 1.0), size = std::pow(10.0, uniform(-1.0, 1.5));
    at.u.first = kind < 0.25 ? g.lower : kind < 0.5 ? g.upper : uniform(g.lower, g.upper);
    at.u.last = at.u.first + uniform(-size, size);
    at.u.before = 2.0 * at.u.first - at.u.last + uniform(-size, size);
    at.u.after = 2.0 * at.u.last - at.u.first + uniform(-size, size);
    at.apart.slack = size * std::pow(10.0, uniform(-4.0, -1.0));
    return at;
}

} // namespace

int main() {
    drawn::numbers.seed(5);
    tally all;
    const stops g{-1.0, 1.0};
    for (int i = 0; i < 80000; ++i)
        check(draw(g), g, all);
    std::printf(
        "%d meetings: %d cross, %d of them back, %d clear; %d curves wrong, %d places far\n",
        all.meetings, all.crossings, all.returns, all.clear, all.wrong, all.far);
    const int few = all.meetings / 100;
    const bool decides = all.crossings > few && all.returns > few && all.clear > few;
    return decides && all.wrong == 0 && all.far < all.returns / 20 ? 0 : 1;
}
