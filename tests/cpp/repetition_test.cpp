// Flights that are said to be clear, beside what u is on the way. Prints what fails, returns 1.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "drawn_flow.hpp"
#include "vibroimpact/search/grid/recall_period.hpp"

namespace {

#ifndef MIXED
#define MIXED false // repetition_test_mixed.cpp
#endif
using flow = vi::modal_flow<double, vi::fixed<6, 1, 1, MIXED>>;
using mode = vi::mode<double, flow>;
using state = vi::vec<double, 6>;
using point = vi::detail::flight_point<double>;
constexpr int samples = 400;
using drawn::fastest, drawn::uniform;

void draw_system(mode& m) {
    drawn::draw(m.flow, [] { return uniform(-0.5, 0.5); });
    const auto lag = [] { return MIXED ? uniform(-1.0, 1.0) : 0.0; };
    const double row[] = {1.0, lag(), -1.0, lag(), uniform(-1.0, 1.0), uniform(-1.0, 1.0)};
    vi::set_guard(m.guards[0], {row, 0.1, -1.0, 1.0, 0}, m.flow);
    vi::prepare_search(m, true);
}

double u_of(const mode& m, const state& y) {
    return vi::guard_distance(m.guards[0], y, m.flow);
}
point point_of(const mode& m, const state& y) {
    return {u_of(m, y), vi::guard_speed(m.guards[0], y, m.flow),
            vi::guard_bend(m.guards[0], y, m.flow)};
}

// The Bernstein coefficients of the quintic with these values, first and second derivatives.
struct quintic {
    double b[6];
    quintic(const point& from, const point& to, double t)
        : b{from.u,
            from.u + from.slope * t / 5,
            from.u + 2 * from.slope * t / 5 + from.bend * t * t / 20,
            to.u - 2 * to.slope * t / 5 + to.bend * t * t / 20,
            to.u - to.slope * t / 5,
            to.u} {}
    double operator()(double x) const {
        double p[6];
        std::copy(b, b + 6, p);
        for (int n = 5; n > 0; --n)
            for (int i = 0; i < n; ++i)
                p[i] = (1 - x) * p[i] + x * p[i + 1];
        return p[0];
    }
};

struct tally {
    int wrong = 0, accepted = 0, clear = 0;
    bool exact = true;          // the answer changes where it should
    double largest_error = 0.0; // of the quintic, as a part of its bound
};

// Limits at random near the extremes of u, the ends of the flight between them.
void check_flight(mode& m, tally& all) {
    const double theta = uniform(0.0, 6.3), t = uniform(0.05, 1.0) * m.flow.scan_length;
    const state y{{uniform(-2, 2), uniform(-2, 2), uniform(-2, 2), uniform(-2, 2), std::sin(theta),
                   fastest * std::cos(theta)}};
    const state end = m.flow.flight(y, t);
    const point from = point_of(m, y), to = point_of(m, end);
    auto& g = m.guards[0];
    const double slack = vi::detail::slack_of_flight(g, m.flow, y, t);
    const quintic between(from, to, t);
    const auto [least, most] = std::minmax_element(between.b + 1, between.b + 5);
    for (const double part : {1.0 - 1e-6, 1.0 + 1e-6}) {
        g.lower = *least - part * slack;
        g.upper = *most + part * slack;
        const bool said = vi::detail::keeps_between(g, from, to, t, slack);
        all.exact = all.exact && said == (part > 1.0);
    }
    double low = vi::min(from.u, to.u), high = vi::max(from.u, to.u);
    double seen_low = vi::infinity(), seen_high = -vi::infinity();
    for (int i = 1; i < samples; ++i) {
        const double x = i / double(samples), u = u_of(m, m.flow.flight(y, x * t));
        seen_low = vi::min(seen_low, u);
        seen_high = vi::max(seen_high, u);
        const double part = x * (1 - x), bound = slack * (43000.0 / 720) * part * part * part;
        const double error = vi::abs(u - between(x));
        all.largest_error = vi::max(all.largest_error, error / (bound + 1e-13));
    }
    const double room = 0.3 * (seen_high - seen_low);
    g.lower = vi::min(low, seen_low + uniform(-room, 0.5 * room));
    g.upper = vi::max(high, seen_high + uniform(-0.5 * room, room));
    const bool said = vi::detail::keeps_between(g, from, to, t, slack);
    const bool is = seen_low > g.lower && seen_high < g.upper;
    all.clear += is;
    all.accepted += said;
    all.wrong += said && !is;
}

} // namespace

int main() {
    drawn::numbers.seed(7);
    tally all;
    for (int system = 0; system < 200; ++system) {
        mode m{};
        draw_system(m);
        for (int i = 0; i < 50; ++i)
            check_flight(m, all);
    }
    std::printf("%d clear, %d accepted, %d wrong; the quintic errs by %.3f of its bound%s\n",
                all.clear, all.accepted, all.wrong, all.largest_error,
                all.exact ? "" : "; not exact");
    // A bound of which the truth is a tenth somewhere is not a guess.
    const bool tight = all.largest_error <= 1.0 && all.largest_error > 0.1;
    return all.wrong == 0 && all.accepted > all.clear / 10 && all.exact && tight ? 0 : 1;
}
