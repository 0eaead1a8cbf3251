// The engine on every scalar: bits of lanes, derivatives of jets, counts of operations, a hash.
//
//     engine_test FILE hash EVENTS     FNV-1a hash of every event of every start
//     engine_test FILE lanes EVENTS    packs as wide as registers are, also of jets, against the scalar
//                                      engine, bit by bit
//     engine_test FILE jet EVENTS      jets against the product of saltation matrices, and
//     engine_test FILE count EVENTS    operations per event: with -DJETS_AND_COUNTS, in one build
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "system_file.hpp"
#include "vibroimpact/numeric/counting.hpp"
#include "vibroimpact/simd/lane_run.hpp"

namespace {

#ifndef MIXED
#define MIXED false // engine_test_mixed.cpp
#endif
using shape = vi::fixed<6, 1, 1, MIXED>;
using flow = vi::modal_flow<double, shape>;
using system_type = binding::compiled_system<flow>;
using starts_type = std::vector<binding::start_data>;
constexpr int n = 6;
constexpr double horizon = 1e6;

bool same_bits(double a, double b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
}

struct fnv {
    std::uint64_t state = 14695981039346656037ull;
    void add(double x) {
        unsigned char bytes[sizeof x];
        std::memcpy(bytes, &x, sizeof x);
        for (unsigned char b : bytes)
            state = (state ^ b) * 1099511628211ull;
    }
};

void hash(const system_type& system, const starts_type& starts, int events) {
    fnv sum;
    for (const auto& start : starts) {
        auto at = system.begin<double>(start);
        vi::clock now;
        vi::flight_memory<flow> memory;
        for (int i = 0; i < events; ++i) {
            const auto e = vi::step(system.hybrid(), at, horizon, memory);
            now.add(e.duration);
            sum.add(static_cast<int>(e.what));
            sum.add(e.side);
            sum.add(now.high);
            sum.add(now.low);
            sum.add(e.rate_after);
            for (int j = 0; j < n; ++j)
                sum.add(at.y[j]);
        }
    }
    std::printf("%016llx\n", static_cast<unsigned long long>(sum.state));
}

// What a run showed: every event of it, and the growth of its tangent where it has one.
struct seen {
    const system_type& system;
    std::vector<vi::event<double, shape>> events;
    std::vector<vi::vec<double, n>> after;
    vi::growth<1> tangent{1.0};
    vi::trajectory<vi::jet<double, 1>, shape> last{};

    bool see(const vi::event<double, shape>& e, const vi::trajectory<double, shape>& at,
             const vi::clock&) {
        events.push_back(e);
        after.push_back(at.y);
        return true;
    }
    bool see(const vi::event<vi::jet<double, 1>, shape>& e,
             vi::trajectory<vi::jet<double, 1>, shape>& at, const vi::clock& now) {
        vi::follow(system.hybrid(), vi::norm_of(system.hybrid()), last, e, at, now, tangent);
        last = at;
        return see(vi::detail::values(e, n), vi::detail::values(at, n, 1), now);
    }
};

bool equal(const seen& a, const seen& b) {
    if (a.events.size() != b.events.size()) return false;
    for (std::size_t k = 0; k < a.events.size(); ++k) {
        const auto &e = a.events[k], &f = b.events[k];
        if (e.what != f.what || e.contact != f.contact || e.side != f.side ||
            !same_bits(e.duration, f.duration) || !same_bits(e.rate_before, f.rate_before) ||
            !same_bits(e.rate_after, f.rate_after))
            return false;
        for (int j = 0; j < n; ++j)
            if (!same_bits(a.after[k][j], b.after[k][j])) return false;
    }
    return same_bits(a.tangent.sum[0], b.tangent.sum[0]) &&
           same_bits(a.tangent.first, b.tangent.first) &&
           same_bits(a.tangent.last, b.tangent.last) && a.tangent.events == b.tangent.events &&
           a.tangent.broken == b.tangent.broken;
}

// Runs of all starts in lanes; every other one is watched from its beginning, the others from the
// last event on: lanes count without looking. Some have no event left.
struct crew {
    const system_type& system;
    const starts_type& starts;
    int events;
    std::vector<seen> runs;
    std::vector<std::size_t> on;                 // start of each lane
    std::vector<vi::motion<double, flow>> there; // its motion
    std::size_t next_start = 0;

    vi::limits limit() const { return {1e300, horizon, events, 1 << 30}; }
    vi::run_progress progress(std::size_t s) const { return {{}, s % 4 == 3 ? events : 0}; }
    bool next(int i, vi::lane_slot<flow>& slot) {
        if (next_start == starts.size()) return false;
        on[i] = next_start++;
        there[i] = {system.begin<double>(starts[on[i]]), progress(on[i])};
        slot = {&system.hybrid(), &there[i], limit(), on[i] % 2 == 0 ? 0.0 : 1e299,
                runs[on[i]].tangent};
        return true;
    }
    bool see(int i, const vi::event<double, shape>& e, const vi::trajectory<double, shape>& at,
             const vi::clock& now) {
        return runs[on[i]].see(e, at, now);
    }
    bool build(int, int) { return false; }
    void end(int i, const vi::lane_slot<flow>& slot, vi::run_end) {
        auto& run = runs[on[i]];
        if (on[i] % 2 != 0) run.see(vi::event<double, shape>{}, slot.run->at, slot.run->so_far.now);
        run.events.back().duration = slot.run->so_far.now.time();
        run.tangent = slot.tangent;
    }
    bool interrupted() { return false; }
};

template <class S>
vi::trajectory<S, shape> begin(const system_type& system, const binding::start_data& start) {
    if constexpr (vi::scalar_traits<S>::is_jet)
        return vi::with_tangents<1>(system.hybrid(), system.begin<double>(start), 1);
    else
        return system.begin<double>(start);
}

template <class T>
int compare_lanes(const system_type& system, const starts_type& starts, int events) {
    using S = vi::lane_t<T>;
    using runs = vi::lane_run<T, flow, crew>;
    constexpr int lanes = vi::scalar_traits<T>::lanes;
    const char* name = vi::scalar_traits<T>::is_jet ? "tangents" : "lanes";
    crew all{system,
             starts,
             events,
             std::vector<seen>(starts.size(), seen{system}),
             std::vector<std::size_t>(vi::lanes_in_turn<T>),
             std::vector<vi::motion<double, flow>>(vi::lanes_in_turn<T>)};
    runs(all).run();
    int statuses = 0;
    for (std::size_t s = 0; s < starts.size(); ++s) {
        seen alone{system};
        auto at = begin<S>(system, starts[s]);
        if constexpr (vi::scalar_traits<S>::is_jet) alone.last = at;
        auto so_far = all.progress(s);
        vi::run(system.hybrid(), at, so_far, all.limit(), alone);
        for (const auto& e : alone.events)
            statuses |= 1 << static_cast<int>(e.what);
        if (s % 2 != 0) {
            alone.events.clear();
            alone.after.clear();
            alone.see(vi::event<double, shape>{}, vi::detail::values(at, n, 1), so_far.now);
        }
        alone.events.back().duration = so_far.now.time();
        if (equal(alone, all.runs[s])) continue;
        std::printf("%s of %d differ in start %zu\n", name, lanes, s);
        return 1;
    }
    std::printf("%s %d equal, statuses %d\n", name, lanes, statuses);
    return 0;
}

int compare_packs(const system_type& system, const starts_type& starts, int events) {
    using numbers = vi::pack<vi::native_lanes>;
    return compare_lanes<numbers>(system, starts, events) |
           compare_lanes<vi::jet<numbers, 1>>(system, starts, events);
}

#if defined(JETS_AND_COUNTS)
// From stop to stop: d y after one impact = J (1 - f h / (h f)) exp(B t) d y before, f = y' there.
void saltate(const vi::hybrid<flow>& system, const vi::event<double, shape>& e,
             vi::vec<double, n>& tangent) {
    const auto& free = system.modes[0];
    const auto still = free.flow.flight(vi::vec<double, n>{}, e.duration);
    tangent = free.flow.flight(tangent, e.duration);
    for (int j = 0; j < n; ++j)
        tangent[j] -= still[j];
    const auto& law = system.laws[0];
    const double r = vi::restitution_at(system, 0, e.side);
    const auto jump = [&](vi::vec<double, n> y) {
        const double rate = vi::dot(free.guards[0].rows[1], y, n);
        for (int j = 0; j < n; ++j)
            y[j] -= law.impulse[j] * ((1.0 + r) * rate / law.mobility[0]);
        return y;
    };
    const auto flow_rate = free.flow.derivative(e.before);
    const double late = -vi::dot(free.guards[0].rows[0], tangent, n) /
                        vi::dot(free.guards[0].rows[0], flow_rate, n);
    for (int j = 0; j < n; ++j)
        tangent[j] += flow_rate[j] * late;
    tangent = jump(tangent);
}

int compare_jets(const system_type& system, const starts_type& starts, int events) {
    using jet = vi::jet<double, 5>;
    double worst = 0.0;
    for (const auto& start : starts) {
        auto at = system.begin<double>(start);
        vi::trajectory<jet, shape> seeded{};
        vi::vec<double, n> columns[5] = {};
        for (int j = 0; j < n; ++j)
            seeded.y[j] = jet(at.y[j]);
        seeded.touching[0] = at.touching[0];
        seeded.rate[0] = jet(at.rate[0]);
        for (int j = 0; j < 5; ++j) {
            if (j < 4)
                columns[j][j] = 1.0;
            else { // along the forcing circle
                columns[j][4] = at.y[5];
                columns[j][5] = -system.hybrid().modes[0].flow.k[2] * at.y[4];
            }
            for (int i = 0; i < n; ++i)
                seeded.y[i].d[j] = columns[j][i];
        }
        vi::flight_memory<flow> memory, seeded_memory;
        for (int k = 0; k < events; ++k) {
            const auto e = vi::step(system.hybrid(), at, horizon, memory);
            vi::step(system.hybrid(), seeded, horizon, seeded_memory);
            if (e.what != vi::status::impact) break;
            for (int j = 0; j < 5; ++j) {
                saltate(system.hybrid(), e, columns[j]);
                double size = 0.0, error = 0.0;
                for (int i = 0; i < n; ++i) {
                    size = std::max(size, std::abs(columns[j][i]));
                    error = std::max(error, std::abs(columns[j][i] - seeded.y[i].d[j]));
                }
                worst = std::max(worst, error / size);
            }
        }
    }
    std::printf("%a\n", worst);
    return 0;
}

struct cost {
    static inline vi::operation_counts counts;
};

int count(const system_type& system, const starts_type& starts, int events) {
    using number = vi::counting<cost>;
    for (const auto& start : starts) {
        const auto at = system.begin<double>(start);
        vi::trajectory<number, shape> counted{};
        for (int j = 0; j < n; ++j)
            counted.y[j] = number(at.y[j]);
        counted.touching[0] = number(at.touching[0]);
        counted.rate[0] = number(at.rate[0]);
        vi::flight_memory<flow> memory;
        for (int k = 0; k < events; ++k)
            vi::step(system.hybrid(), counted, horizon, memory);
    }
    std::printf("%.1f\n", static_cast<double>(cost::counts.flops()) /
                              (static_cast<double>(starts.size()) * events));
    return 0;
}
#endif

} // namespace

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    test::reader in(argv[1]);
    const auto system = test::read_compiled<flow>(in);
    const auto starts = test::read_starts(in);
    const std::string what = argv[2];
    const int events = std::atoi(argv[3]);
    if (what == "lanes") return compare_packs(system, starts, events);
#if defined(JETS_AND_COUNTS)
    if (what == "jet") return compare_jets(system, starts, events);
    if (what == "count") return count(system, starts, events);
#endif
    hash(system, starts, events);
    return 0;
}
