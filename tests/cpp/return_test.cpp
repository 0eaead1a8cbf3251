// Flights that come back onto the stop that they leave within about a quarter of a step: where micro-bounces end
// and rounds begin. Lanes, which bounce after a certified step, have the bits of single runs, which try a
// round first. Reads nothing.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "drawn_flow.hpp"
#include "one_mode.hpp"
#include "vibroimpact/simd/lane_run.hpp"

namespace {

using shape = vi::fixed<6, 1, 1>;
using flow = vi::modal_flow<double, shape>;
using motion = vi::motion<double, flow>;
using drawn::fastest, drawn::step, drawn::uniform;

const vi::limits limit{1e300, 1e6, 6, 1 << 30}; // a few events

struct nobody {
    bool see(const auto&, const auto&, const auto&) { return true; }
};

struct crew {
    const vi::hybrid<flow>& system;
    std::vector<motion>& runs;
    std::size_t begun = 0;

    bool next(int, vi::lane_slot<flow>& slot) {
        if (begun == runs.size()) return false;
        slot = {&system, &runs[begun++], limit, 0.0, {}};
        return true;
    }
    bool see(int, const auto&, const auto&, const auto&) { return true; }
    bool build(int, int) { return false; }
    void end(int, const auto&, vi::run_end) {}
    bool interrupted() { return false; }
};

// Two masses, the stop between them, their blow elastic: bounces do not die out.
struct machine : one_mode<flow> {
    machine() {
        drawn::draw(free.flow, [] { return uniform(-0.5, 0.5); });
        const double row[] = {1.0, 0.0, -1.0, 0.0, 0.4, -0.3};
        vi::set_guard(free.guards[0], {row, 0.1, -100.0, 1.0, 0}, free.flow);
        wire();
        auto& law = hybrid.laws[0];
        law.impulse[3] = law.shift[2] = -1.0;
        law.mobility[0] = 2.0;
        law.effective_mass = 0.5;
        hybrid.inverse_omega_squared[0] = 1.0 / (fastest * fastest);
    }

    // On the stop, and back on it after some time; false where the free motion does not lead back.
    bool leave(motion& out) const {
        const auto& g = free.guards[0];
        const double theta = uniform(0.0, 6.3), time = uniform(0.1, 0.3) * step;
        auto& y = out.at.y;
        y = {
            {uniform(-2, 2), uniform(-2, 2), 0.0, 0.0, std::sin(theta), fastest * std::cos(theta)}};
        y[2] = vi::guard_distance(g, y, free.flow) - g.upper;
        const auto bend = [&] { return vi::guard_value(g, 2, y, 6); };
        for (int i = 0; i < 60; ++i) // the bend depends on the speed, where dashpots are
            y[3] += vi::guard_value(g, 1, y, 6) + 0.5 * time * bend();
        out.at.touching[0] = 1.0;
        out.at.rate[0] = -vi::guard_value(g, 1, y, 6);
        return out.at.rate[0] > 0.0 && bend() > 0.0;
    }
};

bool equal(const motion& a, const motion& b) {
    return std::memcmp(&a.at.y, &b.at.y, sizeof a.at.y) == 0 &&
           a.so_far.now.time() == b.so_far.now.time();
}

// How many differ.
int compare(const machine& s, std::vector<motion> alone) {
    auto together = alone;
    crew all{s.hybrid, together};
    vi::lane_run<vi::pack<vi::native_lanes>, flow, crew>(all).run();
    int differ = 0;
    nobody looks;
    for (std::size_t i = 0; i < alone.size(); ++i) {
        vi::run(s.hybrid, alone[i].at, alone[i].so_far, limit, looks);
        differ += !equal(alone[i], together[i]);
    }
    return differ;
}

} // namespace

int main() {
    drawn::numbers.seed(5);
    int differ = 0, runs = 0;
    for (int k = 0; k < 1000; ++k) {
        const auto s = std::make_unique<machine>();
        std::vector<motion> starts;
        for (int i = 0; i < 100; ++i)
            if (motion one{}; s->leave(one)) starts.push_back(one);
        runs += static_cast<int>(starts.size());
        differ += compare(*s, starts);
    }
    std::printf("%d runs, %d differ\n", runs, differ);
    return differ == 0 && runs > 40000 ? 0 : 1;
}
