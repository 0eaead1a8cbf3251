// What a scan along the wide grid says, beside where u is between its extremes. Prints what fails,
// returns 1.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "drawn_flow.hpp"
#include "vibroimpact/search/grid/grid_bounds.hpp"

namespace {

using shape = vi::fixed<6, 1, 1>;
using flow = vi::modal_flow<double, shape>;
using mode = vi::mode<double, flow>;
using state = vi::vec<double, 6>;
constexpr int samples = 60; // of an interval: extremes are refined
using drawn::fastest, drawn::step, drawn::uniform;

double push_or_none() {
    return uniform(0.0, 1.0) < 0.5 ? 0.0 : uniform(-0.5, 0.5);
}

// In units of `unit`.
void set_stops(mode& m, double lower, double upper, double unit) {
    const double row[] = {unit, 0.0, -unit, 0.0, 0.4 * unit, -0.3 * unit};
    vi::set_guard(m.guards[0], {row, 0.1 * unit, lower, upper, 0}, m.flow);
    vi::prepare_search(m, true);
}

vi::detail::scan_result<double> scan(const mode& m, const state& y, double touching = 0.0) {
    vi::detail::grid_scan<double, 1> wide;
    wide.scan(m, vi::wide_grid, y, {{touching}});
    wide.cross(m);
    return wide.result;
}

// u at the start, at its extremes and at the ends of the intervals, in order.
struct turn {
    double time, u;
};
std::vector<turn> turns_of(const mode& m, const state& y) {
    const double h = m.flow.grid_step(vi::wide_grid) / samples;
    const auto at = [&](double t) { return m.flow.flight(y, t); };
    const auto speed = [&](double t) { return vi::guard_speed(m.guards[0], at(t), m.flow); };
    std::vector<turn> out{{0.0, vi::guard_distance(m.guards[0], y, m.flow)}};
    for (int i = 0; i < vi::detail::grid_intervals * samples; ++i) {
        double low = i * h, high = low + h;
        const double end = high, sign = speed(low);
        if (sign * speed(high) < 0.0) {
            for (int n = 0; n < 50; ++n) {
                const double middle = 0.5 * (low + high);
                (sign * speed(middle) > 0.0 ? low : high) = middle;
            }
            out.push_back({low, vi::guard_distance(m.guards[0], at(low), m.flow)});
        }
        out.push_back({end, vi::guard_distance(m.guards[0], at(end), m.flow)});
    }
    return out;
}

struct tally {
    int scans = 0, clear = 0, crossings = 0, returns = 0, undecided = 0, wrong = 0, close = 0;
};

state draw_state(double big) {
    const double theta = uniform(0.0, 6.3), q = uniform(-1, 1) * big;
    return {{q + uniform(-2, 2), uniform(-2, 2), q + uniform(-2, 2), uniform(-2, 2),
             std::sin(theta), fastest * std::cos(theta)}};
}

// What a scan said of a flight that begins between its stops, or leaves one; the place is to be one
// next to the crossing.
void judge(const mode& m, const state& y, const std::vector<turn>& turns,
           const vi::detail::scan_result<double>& seen, bool above, double stop, tally& all) {
    const double part = m.flow.part(), tiny = 1e-9 * step;
    const double from = seen.begin * part, to = (seen.begin + seen.length) * part;
    const bool back = seen.found && seen.begin == vi::detail::soonest_return;
    bool wrong = false, was_out = false;
    int changes = 0;
    for (std::size_t i = 1; i < turns.size() && turns[i].time <= to + tiny; ++i) {
        const bool out = above ? turns[i].u >= stop : turns[i].u <= stop;
        if (out && !back && turns[i].time <= from - tiny) wrong = true;
        changes += out != was_out;
        was_out = out;
    }
    if (seen.found) {
        wrong = wrong || changes != 1 || (seen.stop.side > 0.0) != above;
        const auto out_at = [&](double place) {
            const auto there = m.flow.flight(y, std::fmax(place, 0.0) * part);
            const double u = vi::guard_distance(m.guards[0], there, m.flow);
            return above ? u >= stop : u <= stop;
        };
        const bool whole = seen.place == std::round(seen.place);
        all.close += whole && !out_at(seen.place - 1.0) && out_at(seen.place + 1.0);
    }
    ++all.scans;
    all.clear += seen.clear;
    all.crossings += seen.found;
    all.undecided += !seen.clear && !seen.found;
    all.wrong += wrong;
}

// Stops next to an extreme, by so small a part of what adds up to u that the margin is too coarse to tell
// the side.
void check_scan(mode& m, double size, double unit, tally& all) {
    const double big = std::pow(size, uniform(0.0, 1.0));
    const auto y = draw_state(big);
    set_stops(m, -1e3 * unit, 1e3 * unit, unit);
    const auto turns = turns_of(m, y);
    const bool above = uniform(0, 1) < 0.5, furthest = uniform(0, 1) < 0.5;
    const auto [least, most] = std::minmax_element(
        turns.begin(), turns.end(), [](const turn& a, const turn& b) { return a.u < b.u; });
    const turn& some = turns[1 + drawn::numbers() % (turns.size() - 1)];
    const turn& one = !furthest ? some : above ? *most : *least;
    const double near = uniform(-1, 1) * (big + 1.0) * unit * std::pow(10.0, uniform(-12.0, 1.0));
    const double stop = one.u + near, room = 1e2 * size * std::pow(1e10, uniform(0.0, 1.0));
    const double far = turns[0].u + (above ? -1.0 : 1.0) * room * unit;
    if (above ? turns[0].u >= stop : turns[0].u <= stop) return;
    set_stops(m, above ? far : stop, above ? stop : far, unit);
    judge(m, y, turns, scan(m, y), above, stop, all);
}

// Of a flight that leaves a stop, often to come back onto it soon.
void check_departure(mode& m, tally& all) {
    const auto y = draw_state(1.0);
    set_stops(m, -1e3, 1e3, 1.0);
    const auto turns = turns_of(m, y);
    const double stop = turns[0].u;
    const bool above = vi::guard_speed(m.guards[0], y, m.flow) < 0.0;
    set_stops(m, above ? stop - 1e2 : stop, above ? stop : stop + 1e2, 1.0);
    const auto seen = scan(m, y, above ? 1.0 : -1.0);
    judge(m, y, turns, seen, above, stop, all);
    all.returns += seen.found && seen.begin == vi::detail::soonest_return;
}

// Numbers whose rounding is larger than the room between the stops: nothing is said.
int said_of_lost() {
    int said = 0;
    mode m{};
    drawn::draw(m.flow, push_or_none);
    set_stops(m, -1.0, 1.0, 1.0);
    for (const double far : {1e30, 1e200, vi::not_a_number()}) {
        const auto seen = scan(m, {{far, 0.0, far, 0.0, 0.0, fastest}});
        said += seen.clear || seen.found || seen.begin > 0.0;
    }
    return said;
}

} // namespace

int main() {
    drawn::numbers.seed(11);
    tally all;
    for (int system = 0; system < 160; ++system) {
        mode m{};
        drawn::draw(m.flow, push_or_none);
        const double size = system % 2 ? 1.0 : 1e3, unit = system % 3 ? 1.0 : 1e-9;
        for (int i = 0; i < 25; ++i)
            check_scan(m, size, unit, all);
        for (int i = 0; i < 25; ++i)
            check_departure(m, all);
    }
    const int said = said_of_lost();
    std::printf("%d scans: %d clear, %d cross, %d of them back, %d undecided; %d wrong, "
                "%d places close; %d said of lost numbers\n",
                all.scans, all.clear, all.crossings, all.returns, all.undecided, all.wrong,
                all.close, said);
    const bool decides = all.clear > all.scans / 10 && all.crossings > all.scans / 10 &&
                         all.returns > all.scans / 50;
    return all.wrong == 0 && decides && all.close > 0.95 * all.crossings && said == 0 ? 0 : 1;
}
