// The margins of what proves flights clear: above rounding, and as stated. Prints what fails, returns 1.

// Warnings of masks that are single numbers, and of stops that no lane reads; wrong ones with GCC.
#if defined(__clang__)
#pragma clang diagnostic ignored "-Wbitwise-instead-of-logical"
#else
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#pragma GCC diagnostic ignored "-Warray-bounds"
#endif

#include <cstdio>

#include "one_mode.hpp"
#include "vibroimpact/engine/run.hpp"
#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/system/assemble.hpp"

namespace {

using shape = vi::fixed<2, 0, 1>;
using flow = vi::modal_flow<double, shape>;
using state = vi::vec<double, 2>;
constexpr double step = 0.5, below = 1.0 - 0x1p-10, above = 1.0 + 0x1p-10;

template <class Flow>
struct machine_of : one_mode<Flow> {
    // One coordinate between stops.
    machine_of(const vi::flow_numbers& numbers, double lower, double upper) {
        const double row[] = {1.0, 0.0};
        auto& free = this->free;
        vi::set_flow(free.flow, numbers);
        vi::set_guard(free.guards[0], {row, 0.0, lower, upper, 0}, free.flow);
        this->wire();
    }
};

constexpr double none = 0.0;

// q'' = a.
struct machine : machine_of<flow> {
    machine(double a, double lower, double upper)
        : machine_of({step, &none, &none, &a, nullptr, nullptr}, lower, upper) {}
};

bool is(const char* name, bool right) {
    if (!right) std::fprintf(stderr, "%s\n", name);
    return right;
}

// Thrown up to just below a stop, by less than the rounding of its terms, where the top of the flight is at
// a time of the narrow grid: there the bounds of a parabola are the parabola itself.
bool a_top_within_rounding_is_a_graze() {
    bool right = true;
    for (int n = 4; n < 40; ++n) {
        const double time = n * 3 * (step / vi::parts_of_step), top = time * time / 2.0;
        const machine s(-1.0, -1.0, top * (1.0 + 0x1p-51));
        vi::trajectory<double, shape> at{};
        at.y = state{{0.0, time}};
        const auto e = vi::step(s.hybrid, at, 1e3);
        right &= is("graze", e.what == vi::status::grazing && e.side == vi::upper_side);
    }
    return right;
}

// How far a mass at rest has to be from a stop at 1, in parts of the sum of its terms, limit included, for
// the narrow grid to call it clear.
bool clear_of_the_grid(double distance) {
    const machine s(0.0, -1.0, 1.0);
    const double place = (1.0 - distance) / (1.0 + distance); // 1 - q = distance (1 + q)
    vi::detail::grid_scan<double, 1> scan;
    const vi::vec<double, 1> open{};
    vi::detail::scan_narrow_grid(s.free, state{{place, 0.0}}, open, scan);
    return scan.result.clear;
}

// The same for a flight that is recalled, to its other end.
bool clear_of_a_recalled_flight(double distance) {
    const machine s(0.0, -1.0, 1.0);
    const auto& g = s.free.guards[0];
    const state y{{(1.0 - distance) / (1.0 + distance), 0.0}};
    const double slack = vi::detail::slack_of_flight(g, s.free.flow, y, 2.0);
    const vi::detail::flight_point<double> still{y[0], 0.0, 0.0};
    return vi::detail::keeps_between(g, still, still, 2.0, slack);
}

// And for a leap of the march.
bool clear_of_a_leap(double distance) {
    const machine s(0.0, -1.0, 1.0);
    const double place = (1.0 - distance) / (1.0 + distance);
    return vi::stays_clear(s.free.guards[0], s.free.flow, state{{place, 0.0}}, 100.0);
}

bool is_off(double distance) {
    const machine s(0.0, -1.0, 1.0);
    vi::trajectory<double, shape> start{};
    start.touching[0] = vi::upper_side;
    const double place = (1.0 - distance) / (1.0 + distance);
    return vi::detail::has_left(s.free, state{{place, 0.0}}, start);
}

template <class Clear>
bool turns_at(const char* name, double margin, const Clear& clear) {
    return is(name, clear(margin * above) && !clear(margin * below));
}

// The size beyond which a state has diverged, and a clearance that rounding just leaves.
bool states_diverge_where_they_are_said_to() {
    const machine s(0.0, -1.0, vi::infinity());
    const auto diverged = [](const machine& at, double q) {
        return vi::has_diverged(at.free, state{{q, 0.0}});
    };
    const double largest = 0x1p256, lost = 0x1p44 - 1.0; // 16 * 64 * 2^-53 (q + 1) = 2
    const machine narrow(0.0, -1.0, 1.0);
    return is("size", diverged(s, largest) && !diverged(s, largest * below)) &&
           is("clearance", diverged(narrow, lost * above) && !diverged(narrow, lost * below)) &&
           is("no number", diverged(s, vi::not_a_number()));
}

// q'' = -q as a full matrix, without a norm, so that it is marched: between far stops it takes too many
// steps, and asks every 4096 of them whether it may go on.
bool a_march_without_end_asks_and_gives_up() {
    using dense = vi::dense_flow<double, shape>;
    static int asked, allowed;
    const double matrix[] = {0.0, 1.0, -1.0, 0.0}, constant[] = {0.0, 0.0};
    const machine_of<dense> s({step, nullptr, nullptr, nullptr, matrix, constant}, -1e3, 1e3);
    const auto end = [&](int most) {
        vi::trajectory<double, shape> at{};
        at.y = state{{1.0, 0.0}};
        vi::flight_memory<dense> memory;
        asked = 0;
        allowed = most;
        const auto ask = +[] { return ++asked > allowed; };
        return vi::step(s.hybrid, at, 1e12, memory, ask).what;
    };
    return is("interrupted", end(2) == vi::status::searching && asked == 3) &&
           is("steps", end(1 << 30) == vi::status::steps && asked == vi::most_searched);
}

} // namespace

int main() {
    constexpr double margin = 0x1p-30;
    bool right = a_top_within_rounding_is_a_graze();
    right &= turns_at("narrow grid", margin, clear_of_the_grid);
    right &= turns_at("recalled flight", margin, clear_of_a_recalled_flight);
    right &= turns_at("leap", margin, clear_of_a_leap);
    right &= turns_at("departure", margin, is_off);
    right &= states_diverge_where_they_are_said_to();
    right &= a_march_without_end_asks_and_gives_up();
    return right ? 0 : 1;
}
