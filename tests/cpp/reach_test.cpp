// How far a contact is said to get, beside how far it gets. Prints what fails, returns 1.
#include <cstdio>

#include "vibroimpact/numeric/jet.hpp"
#include "vibroimpact/search/certified_flight.hpp"
#include "vibroimpact/system/assemble.hpp"

namespace {

using flow = vi::modal_flow<double, vi::fixed<2, 0, 1>>;
using guard = vi::guard<double, 2>;

struct block {
    double k, c, a;
};

// u = r q + s q' between limits symmetric to `middle`.
vi::mode<double, flow> one_block(const block& b, double r, double s, double middle, double limit) {
    const double row[] = {r, s};
    vi::mode<double, flow> m{};
    vi::set_flow(m.flow, {0.25, &b.k, &b.c, &b.a, nullptr, nullptr});
    vi::set_guard(m.guards[0], {row, 0.0, middle - limit, middle + limit, 0}, m.flow);
    return m;
}

// Clear for so long?
bool clear(const block& b, double r, double s, double q, double v, double middle, double limit,
           double time) {
    const auto m = one_block(b, r, s, middle, limit);
    return vi::stays_clear(m.guards[0], m.flow, vi::vec<double, 2>{{q, v}}, time);
}

// The time until a limit of 5 on one side is surely met, from u = r q + s q'.
bool met_after(const char* name, const block& b, double r, double s, double q, double v,
               double time) {
    const auto m = one_block(b, r, s, 0.0, 5.0);
    const double found = vi::surely_met(m.guards[0], m.flow, vi::vec<double, 2>{{q, v}});
    if (found == time || vi::abs(found - time) < 1e-6 * time) return true;
    std::fprintf(stderr, "%s: met after %g, not %g\n", name, found, time);
    return false;
}

// The answer changes at a limit of this size: no less is clear, and a little more is.
bool turns_at(const char* name, const block& b, double r, double s, double q, double v,
              double middle, double size, double time) {
    const bool within = clear(b, r, s, q, v, middle, size * (1.0 + 1e-6), time);
    const bool beyond = clear(b, r, s, q, v, middle, size * (1.0 - 1e-6), time);
    if (within && !beyond) return true;
    std::fprintf(stderr, "%s: within %d, beyond %d\n", name, within, beyond);
    return false;
}

// No limit that the motion reaches may be called clear.
bool never_clear(const char* name, const block& b, double r, double s, double q, double v,
                 double middle, double size, double time) {
    if (!clear(b, r, s, q, v, middle, size * (1.0 - 1e-6), time)) return true;
    std::fprintf(stderr, "%s: said to be clear\n", name);
    return false;
}

// q'' = -k q between stops at -2 and 2.
vi::mode<double, flow> between_stops(double k) {
    const double none = 0.0, row[] = {1.0, 0.0};
    vi::mode<double, flow> m{};
    vi::set_flow(m.flow, {0.5, &k, &none, &none, nullptr, nullptr});
    vi::set_guard(m.guards[0], {row, 0.0, -2.0, 2.0, 0}, m.flow);
    return m;
}

// An oscillator between far stops, without a horizon.
bool a_flight_without_end_takes_too_many_steps() {
    vi::trajectory<double, flow::shape_type> start{};
    start.y = {{1.0, 0.0}};
    const auto end = vi::certified_flight(between_stops(1.0), start, vi::infinity(), false, 0);
    return end.end == vi::flight_end::steps;
}

// A free mass that needs 2^31 steps to its stop is there in few leaps, and at the right time.
bool a_long_drift_takes_few_leaps() {
    vi::trajectory<double, flow::shape_type> start{};
    start.y = {{0.0, 0x1p-29}};
    const auto end = vi::certified_flight(between_stops(0.0), start, vi::infinity(), false, 0);
    return end.end == vi::flight_end::contact && end.side == vi::upper_side && end.examined < 200 &&
           vi::abs(end.duration - 0x1p30) < 1e-12 * 0x1p30;
}

// A free mass between far stops is at its horizon after that time, and there: leaps of 32, 1024 and more steps
// end before. Everything is a multiple of 2^-70, and exact.
bool a_flight_ends_at_its_horizon() {
    const double many[] = {1.0, 32.0, 33.0, 1024.0, 1025.0, 2048.0, 0x1p15, 0x1p16, 0x1p20};
    const double beyond[] = {-1.0, -0.75, 0.0, 0.25, 0.5, 1.0, 1.5};
    const auto m = between_stops(0.0);
    for (double steps : many)
        for (double more : beyond) {
            const double horizon = (steps + more) * m.flow.step;
            vi::trajectory<double, flow::shape_type> start{};
            start.y = {{0.0, 0x1p-40}};
            const auto end = vi::certified_flight(m, start, horizon, false, 0);
            if (end.end == vi::flight_end::horizon && end.duration == horizon &&
                end.y[0] == 0x1p-40 * horizon)
                continue;
            std::fprintf(stderr, "%g steps and %g: %g\n", steps, more, end.duration - horizon);
            return false;
        }
    return true;
}

// Off all stops, but nearer to one than the margin of leaps.
bool a_long_flight_lets_others_be_asked() {
    auto m = between_stops(1.0);
    m.guards[0].upper = 1.0 + 0x1p-32;
    vi::trajectory<double, flow::shape_type> start{};
    start.y = {{1.0, 0.0}};
    const auto end = vi::certified_flight(m, start, 1e6, false, 0);
    return end.end == vi::flight_end::searching && end.duration == 4096 * m.flow.step;
}

// From the upper stop at some speed: a flight that may pause does so after its first step, and what is left of
// it ends where the whole of it does.
bool a_flight_pauses_off_its_stop(double k, double speed) {
    const auto m = between_stops(k);
    vi::trajectory<double, flow::shape_type> start{};
    start.y = {{2.0, -speed}};
    start.touching[0] = vi::upper_side;
    start.rate[0] = speed;
    const auto whole = vi::certified_flight(m, start, 100.0, false, 0);
    const auto paused = vi::certified_flight(m, start, 100.0, true, 0);
    if (paused.end != vi::flight_end::paused || paused.duration != m.flow.step) return false;
    vi::trajectory<double, flow::shape_type> there{};
    there.y = paused.y;
    const auto rest = vi::certified_flight(m, there, 100.0 - paused.duration, false, 1);
    return whole.end == rest.end && whole.side == vi::lower_side &&
           vi::abs(paused.duration + rest.duration - whole.duration) < 1e-13 * whole.duration;
}

// A free mass that is so slow that after a step it is still next to its stop flies on.
bool a_flight_next_to_its_stop_does_not_pause() {
    const double speed = 1e-10;
    vi::trajectory<double, flow::shape_type> start{};
    start.y = {{2.0, -speed}};
    start.touching[0] = vi::upper_side;
    start.rate[0] = speed;
    return vi::certified_flight(between_stops(0.0), start, 5.0, true, 0).end ==
           vi::flight_end::horizon;
}

// The top of a swing, beyond the stop by so little that rounding in a thousand applications could be it.
bool what_rounds_may_have_added_counts() {
    auto m = between_stops(1.0);
    m.guards[0].upper = 2.0 - 1e-13;
    vi::trajectory<double, flow::shape_type> start{};
    start.y = {{0.0, 2.0}};
    const auto end_after = [&](int earlier) {
        return vi::certified_flight(m, start, 2.0, false, earlier).end;
    };
    return end_after(0) == vi::flight_end::contact && end_after(1000) == vi::flight_end::grazing;
}

// Whatever the value was; at rates that are nearly zero it is infinite.
bool a_value_is_set_exactly() {
    const auto set_to = [](double was, double value) {
        return vi::with_value(vi::jet<double, 1>(was), value).v == value;
    };
    return set_to(1.0, 1e-20) && set_to(vi::infinity(), 0.0);
}

} // namespace

int main() {
    const block oscillator{4.0, 0.0, 0.0}, pushed{4.0, 0.0, 8.0}, damped{4.0, 0.5, 0.0};
    const block free{0.0, 0.0, 0.0}, falling{0.0, 0.0, -2.0}, braked{0.0, 0.3, 0.0};
    // amplitudes sqrt(q^2 + v^2 / k), of q' twice as much; around a / k where pushed
    bool right = turns_at("a speed", oscillator, 1, 0, 0.0, 3.0, 0.0, 1.5, 100.0);
    right &= turns_at("a place", oscillator, 1, 0, -1.5, 0.0, 0.0, 1.5, 100.0);
    right &= turns_at("of a speed", oscillator, 0, 1, 1.5, 0.0, 0.0, 3.0, 100.0);
    right &= turns_at("both", oscillator, 1, 1, 0.0, 3.0, 0.0, vi::sqrt(1.5 * 1.5 + 9.0), 100.0);
    right &= turns_at("a constant force", pushed, 1, 0, 2.0, 3.0, 2.0, 1.5, 100.0);
    right &= never_clear("a damped one", damped, 1, 0, 1.5, 0.0, 0.0, 1.5, 100.0);
    // straight on: 0.5 t; falling: q' t - t^2
    right &= turns_at("straight on", free, 1, 0, 0.0, 0.5, 0.0, 5.0, 10.0);
    right &= turns_at("straight back", free, 1, 0, 0.0, -0.5, 0.0, 5.0, 10.0);
    right &= turns_at("one way", free, 1, 0, 0.0, 0.5, 2.5, 2.5 * (1.0 + 1e-7), 10.0);
    right &= never_clear("one way", free, 1, 0, 0.0, -0.5, 3.0, 3.01, 10.0);
    right &= never_clear("falling", falling, 1, 0, 0.0, -0.5, 0.0, 105.0, 10.0);
    right &= never_clear("its speed", falling, 0, 1, 0.0, -0.5, 0.0, 20.5, 10.0);
    right &= never_clear("braked", braked, 1, 0, 0.0, 0.3, 0.0, 1.0 - 0.05, 10.0);
    // drifts that are sure: (5 - q) / v, v / c short of it, sqrt(2 way / a); the rest is infinite
    right &= met_after("a drift", free, 1, 0, 1.0, 0.5, 8.0);
    right &= met_after("a drift back", free, -1, 0, 1.0, 0.5, 8.0);
    right &= met_after("at rest", free, 1, 0, 1.0, 0.0, vi::infinity());
    right &= met_after("a fall", falling, 1, 0, 4.0, 0.0, 3.0);
    right &= met_after("a throw", falling, 1, 0, 4.0, 8.0, 9.0);
    right &= met_after("a speed that grows", falling, 0, 1, 0.0, 1.0, 3.0);
    right &= met_after("a brake", braked, 1, 0, 1.0, 0.3, vi::infinity());
    right &= met_after("a brake pushed", block{0.0, 0.5, 1.0}, 1, 0, 1.0, 0.0, 4.0);
    right &= met_after("a swing", oscillator, 1, 0, 1.0, 9.0, vi::infinity());
    right &= a_flight_without_end_takes_too_many_steps();
    right &= a_long_drift_takes_few_leaps();
    right &= a_flight_ends_at_its_horizon();
    right &= a_long_flight_lets_others_be_asked();
    right &= a_flight_pauses_off_its_stop(1.0, 0.1) && a_flight_pauses_off_its_stop(0.0, 0.1);
    right &= a_flight_next_to_its_stop_does_not_pause();
    right &= what_rounds_may_have_added_counts();
    right &= a_value_is_set_exactly();
    return right ? 0 : 1;
}
