// A member of a batch between its start and its row of results.
//
// Method      load_member() takes it to its start, the host runs it (ensemble.hpp), finish_member()
//             writes down what its observers have seen
// Assumes     its system is built, the free mode at least; rows of results hold what stands for none
// Fails       member_end
#pragma once

#include "vibroimpact/engine/start.hpp"
#include "vibroimpact/ensemble/build.hpp"
#include "vibroimpact/ensemble/ensemble.hpp"

namespace vi {

// A member under way.
template <class Flow>
struct member_state {
    motion<double, Flow> now{};
    vi::window window{};
    vi::observers<Flow> observers{};
};

// A member after its run, as observers write its row of results.
template <class Flow, class Build>
struct finished_member {
    using Shape = typename Flow::shape_type;
    const batch_arrays& batch;
    const hybrid<Flow>& system;
    const vi::window& window;
    Build& build;

    long long row;
    double period;                       // of the forcing; a unit of time without
    double duration;                     // observed; NaN where there was none
    long impacts;                        // in all
    const trajectory<double, Shape>& at; // where it ended
    const double* exponents;             // of its tangents

    VI_HD long long degrees() const { return batch.degrees; }

    // Position, velocity, and phase of the first forcing line, of a state in some mode.
    VI_CALL void write_state(int mode, const vec<double, Flow::max_dimension>& y, double* x,
                             double* v, double* phase) const {
        const auto p = coordinates_of(batch, mode, batch.system[row]);
        const int n = system.dimension();
        for (int i = 0; i < p.degrees; ++i) {
            x[i] = position_of(p, i, y, n);
            v[i] = velocity_of(p, i, y, n);
        }
        *phase = p.lines > 0 ? phase_of(p, 0, y, n) : 0.0;
    }

    // Runs the motion again from its start, and shows it to an observer of runs (engine/run.hpp).
    template <class Observer>
    VI_HD void run_again(Observer& observer) const;
};

namespace detail {

// The start of member i, in the free mode.
template <class Flow>
VI_CALL void start_member(const batch_arrays& b, const hybrid<Flow>& system, long long i,
                          trajectory<double, typename Flow::shape_type>& at) {
    const long long first = i * b.degrees;
    start_at(system, coordinates_of(b, 0, b.system[i]), b.position + first, b.velocity + first,
             b.phases + i * b.lines, at);
}

// Give the elements of a start their states, with modes that the host builds. Where one is missing the run says so.
template <class Flow, class Build>
VI_HD inline void settle_start(const hybrid<Flow>& system,
                               trajectory<double, typename Flow::shape_type>& at, Build& build) {
    if constexpr (Flow::shape_type::max_elements > 0)
        for (;;) {
            const auto states = settle_elements(system, at);
            if (states.what != decision::missing || !build(states.code)) return;
        }
}

// Frequency of the first forcing line of system s; 0 without forcing.
VI_HD inline double forcing_of(const batch_arrays& b, long long s) {
    return b.lines ? b.omegas[s * b.lines] : 0.0;
}

} // namespace detail

template <class Flow, class Build>
template <class Observer>
VI_HD inline void finished_member<Flow, Build>::run_again(Observer& observer) const {
    motion<double, Flow> again{};
    detail::start_member(batch, system, row, again.at);
    detail::settle_start(system, again.at, build);
    detail::run_building(system, again, limits_of(window), observer, build);
}

// Take member i to its start; false if it ends there, behind a stop or beyond all sizes.
template <class Flow, class Build>
VI_HD inline bool load_member(const batch_arrays& b, long long i, const system_room<Flow>& built,
                              member_state<Flow>& out, Build& build) {
    detail::start_member(b, *built.system, i, out.now.at);
    const bool diverged = has_diverged(built.system->modes[0], out.now.at.y);
    if (diverged || behind_stop(*built.system, out.now.at)) {
        const auto end = diverged ? member_end::diverged : member_end::initial_penetration;
        b.end[i] = static_cast<signed char>(end);
        return false;
    }
    detail::settle_start(*built.system, out.now.at, build);
    const long long s = b.system[i];
    out.now.so_far = {};
    out.window = {b.settle[i], b.observe[i], static_cast<long>(b.most_impacts)};
    const member_start<Flow> start{
        out.window.settle,
        out.window.observe,
        detail::forcing_of(b, s),
        b.lines ? b.phases[i * b.lines] : 0.0,
        b.steps[s],
        coordinates_of(b, 0, s),
        {built.rows, 0, built.row_count},
        {b.element_rows, static_cast<int>(b.elements), 2 * (b.degrees + b.lines) + 1},
        b.damping};
    out.observers.begin(b.observers, start, out.now.at);
    return true;
}

// Write down where and why the run of member i ended, and what was seen, if it is the whole window.
template <class Flow, class Build>
VI_HD inline void finish_member(const batch_arrays& b, long long i, const hybrid<Flow>& system,
                                const member_state<Flow>& from, member_end end,
                                const double* exponents, Build& build) {
    const double time = from.now.so_far.now.time(), omega = detail::forcing_of(b, b.system[i]);
    const double observed = time - from.window.settle;
    b.time[i] = time;
    b.end[i] = static_cast<signed char>(end);
    const finished_member<Flow, Build> finished{b,
                                                system,
                                                from.window,
                                                build,
                                                i,
                                                omega > 0.0 ? 2.0 * pi / omega : 1.0,
                                                observed > 0.0 ? observed : not_a_number(),
                                                from.now.so_far.impacts,
                                                from.now.at,
                                                exponents};
    from.observers.write(b.observers, finished, end == member_end::ok);
}

} // namespace vi
