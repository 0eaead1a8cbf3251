// A member of a batch between its start and its row of results.
//
// Method      board() takes it to its start, the host runs it (ensemble.hpp), leave() writes down
//             what its observers have seen
// Assumes     its system is built, the free mode at least
// Fails       member_end
#pragma once

#include "vibroimpact/engine/start.hpp"
#include "vibroimpact/ensemble/results.hpp"

namespace vi {

// Memory that the observers of one member need: places for b.last points of the section, then
// b.strobe_last of the stroboscopic one, and b.longest impacts.
template <class Flow>
struct member_room {
    section_point<typename Flow::shape_type>* points;
    kept_impact<typename Flow::shape_type>* kept;
};

// A member under way.
template <class Flow>
struct passage {
    motion<double, Flow> now{};
    vi::window window{};
    vi::observers<Flow> observers{};
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

// Frequency of the first forcing line of system s; 0 without forcing.
VI_HD inline double forcing_of(const batch_arrays& b, long long s) {
    return b.lines ? b.omegas[s * b.lines] : 0.0;
}

// What the observer of symbols is to know of system s.
template <class Shape>
VI_HD inline void prepare_symbol(const batch_arrays& b, long long s, double tolerance,
                                 long long returns, symbol<Shape>& out) {
    out.tolerance = tolerance;
    out.returns = static_cast<long>(returns);
    out.omega = forcing_of(b, s);
    out.rows = {coordinates_of(b, 0, s), b.lines ? out.omega : 1.0 / b.steps[s]};
}

// From the beginning of the window on, when the first forcing line has a phase that it has at the
// start after so much of a turn.
template <class Shape>
VI_HD inline void prepare_stroboscopic(const batch_arrays& b, long long i, double settle,
                                       stroboscopic<Shape>& out) {
    out.period = 2.0 * pi / forcing_of(b, b.system[i]);
    const double turn = (b.strobe_at - b.phases[i * b.lines]) / (2.0 * pi);
    const double first = (turn - floor(turn)) * out.period;
    const double skipped = floor((settle - first) / out.period);
    out.first = first + skipped * out.period;
    if (out.first < settle) out.first = first + (skipped + 1.0) * out.period;
    out.last = static_cast<long>(b.strobe_last);
}

// Options of the observers that are wanted of a member whose window is known, and what they read.
template <class Flow>
VI_HD inline void prepare_observers(const batch_arrays& b, long long i,
                                    const system_room<Flow>& built, const member_room<Flow>& lent,
                                    const window& w, observers<Flow>& all) {
    const long long s = b.system[i];
    all.begin(static_cast<unsigned>(b.wanted));
    all.settle = w.settle;
    if (all.wants(sees_section))
        all.section = {static_cast<int>(b.contact), static_cast<int>(b.stop),
                       static_cast<long>(b.last), static_cast<long>(b.stride), lent.points};
    if (all.wants(sees_symbol))
        prepare_symbol(b, s, b.symbol_tolerance, b.symbol_returns, all.symbol);
    if (all.wants(sees_settling)) {
        prepare_symbol(b, s, b.settling_tolerance, b.settling_returns, all.settling.orbit);
        all.settling.longest = static_cast<long>(b.longest);
        all.settling.kept = lent.kept;
    }
    if (all.wants(sees_extremes))
        all.extremes.watched = {built.extremes, static_cast<int>(b.extremes_count)};
    if (all.wants(sees_averages))
        all.averages.watched = {built.averages, static_cast<int>(b.averages_count)};
    if (all.wants(sees_rotation)) {
        all.rotation.contact = static_cast<int>(b.rotation_contact);
        all.rotation.side = static_cast<int>(b.rotation_stop);
        all.rotation.stride = static_cast<long>(b.rotation_stride);
        all.rotation.tolerance = b.rotation_tolerance;
        all.rotation.settle = w.settle;
        all.rotation.observe = w.observe;
    }
    if (all.wants(sees_stroboscopic)) {
        prepare_stroboscopic(b, i, w.settle, all.stroboscopic);
        all.stroboscopic.points = lent.points + b.last;
    }
}

} // namespace detail

// Take member i to its start; false if it ends there, behind a stop or beyond all sizes.
template <class Flow>
VI_HD inline bool board(const batch_arrays& b, long long i, const system_room<Flow>& built,
                        const member_room<Flow>& lent, passage<Flow>& out) {
    member_rows<Flow>(b, i).clear();
    detail::start_member(b, *built.system, i, out.now.at);
    const bool diverged = has_diverged(built.system->modes[0], out.now.at.y);
    if (diverged || behind_stop(*built.system, out.now.at)) {
        const auto end = diverged ? member_end::diverged : member_end::behind_stop;
        b.end[i] = static_cast<signed char>(end);
        return false;
    }
    out.now.so_far = {};
    out.window = {b.settle[i], b.observe[i], static_cast<long>(b.most_impacts)};
    detail::prepare_observers(b, i, built, lent, out.window, out.observers);
    out.observers.depart(out.now.at);
    return true;
}

// Write down what was seen, if it is the whole window, and where the run ended; where settling is asked
// for, member i is run again.
template <class Flow, int W, class Build>
VI_HD inline void leave(const batch_arrays& b, long long i, const hybrid<Flow>& system,
                        const passage<Flow>& from, member_end end, const growth<W>& tangents,
                        Build& build) {
    const auto& all = from.observers;
    const double time = from.now.so_far.now.time(), omega = detail::forcing_of(b, b.system[i]);
    const member_rows<Flow> rows(b, i);
    b.time[i] = time;
    b.end[i] = static_cast<signed char>(end);
    rows.write_final(from.now.at);
    if (end != member_end::ok) return;
    rows.write(all, omega > 0.0 ? 2.0 * pi / omega : 1.0, time - from.window.settle);
    rows.write(tangents);
    if (all.wants(sees_settling)) {
        motion<double, Flow> again{};
        detail::start_member(b, system, i, again.at);
        b.settling[i] = settling_time(system, again, from.window, all.settling,
                                      from.now.so_far.impacts, build);
    }
}

} // namespace vi
