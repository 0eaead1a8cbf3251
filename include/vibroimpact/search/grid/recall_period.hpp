// Flights that repeat an earlier one: their end is known, and need not be searched for.
//
// Method      In periodic motion a flight takes as long as the one before last, if not as the last. A
//             memory keeps, of every other flight, how long it took, its propagator and the stop that
//             ended it, once that was the same twice. The next such flight goes there at once, and
//             from there onto the stop by one last step. That no stop was met before, in a flight of
//             time t, is proved by u, u' and u'' at both ends: the quintic that has them is off by at
//             most M t^6/720 x^3 (1-x)^3, x from 0 to 1, M >= |u^(6)| over the flight, and its
//             Bernstein coefficients are
//               u0,  u0 + u0' t/5,  u0 + 2 u0' t/5 + u0'' t^2/20                         (1)
//             and the same from the other end. All is clear if those that are not ends of the flight
//             keep between the limits by M t^6/43200 (theory T16g).                      (2)
//             As w'''' of each share w of u solves the homogeneous equation, the bound W on it in
//             search/grid/grid_bounds.hpp gives |w^(6)| <= (k + c sqrt(k) + c^2) W.              (3)
// Assumes     as search/grid/grid_bounds.hpp does
// Accuracy    margin 2^-30 of the terms in (2), far above rounding
// Fails       a flight that is not proved so is scanned like any other
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/search/last_step.hpp"

namespace vi {

// Durations that differ by so little, in steps, are alike: the next one is expected there, too.
inline constexpr double alike_within = 0x1p-20;

// Way to the end of a flight, and the stop that it ends on.
template <class Flow>
struct known_end {
    using R = typename Flow::real;
    R time;
    typename Flow::template essence<R> rows; // of exp(B time)
    detail::stop_hit<R> stop;
    mask_t<R> ready;
};

// Memory of a run, or of those in the lanes of a pack: what is known of every other flight. Nothing of flows
// without blocks, whose propagators are large.
template <class Flow, bool Remembers = is_modal<Flow>>
struct flight_memory {
    static constexpr bool remembers = false;
    VI_HD void forget() {}
};
template <class Flow>
class flight_memory<Flow, true> {
    using R = typename Flow::real;
    using stored = typename Flow::template essence<R>;

public:
    static constexpr bool remembers = true;
    VI_HD flight_memory() {
        for (int i = 0; i < scalar_traits<R>::lanes; ++i)
            forget(i);
    }
    VI_HD void forget(int lane = 0) {
        set_lane(last_, lane, infinity());
        set_lane(before_, lane, infinity());
        set_lane(even_.ready, lane, false);
        set_lane(odd_.ready, lane, false);
        set_lane(at_odd_, lane, false);
    }
    VI_HOT bool knows_any() const { return knows_any_; }
    VI_HOT mask_t<R> ready() const { return (odd_.ready & at_odd_) | (even_.ready & !at_odd_); }

    // Memory of the flight whose turn it is.
    VI_HOT R time() const { return now(even_.time, odd_.time); }
    VI_HOT detail::stop_hit<R> stop(const Flow& flow) const {
        auto out = even_.stop;
        out.take(at_odd_, odd_.stop, flow);
        return out;
    }
    VI_HOT R row(int i) const { return now(even_.rows[i], odd_.rows[i]); }

    // Flights have ended that were not recalled. One that took as long as the one before last can be
    // next time.
    template <class T>
    VI_HOT void note(const Flow& flow, const mask_t<R>& fresh, const real_t<T>& time,
                     const detail::stop_hit<real_t<T>>& on) {
        const R duration = own(time);
        const R change = abs(duration - before_);
        before_ = select(fresh, last_, before_);
        last_ = select(fresh, duration, last_);
        const mask_t<R> alike = fresh & (change <= alike_within * flow.step);
        if (any(alike)) keep(flow, alike, duration, {own(on.contact), own(on.side), own(on.limit)});
    }
    VI_HOT void drop(const mask_t<R>& lost) {
        even_.ready = even_.ready & !(lost & !at_odd_);
        odd_.ready = odd_.ready & !(lost & at_odd_);
    }
    VI_HOT void take_turns(const mask_t<R>& landed) {
        const mask_t<R> turn = landed & (even_.ready | odd_.ready);
        at_odd_ = (at_odd_ & !turn) | (turn & !at_odd_);
    }

private:
    template <class X>
    VI_HOT static R own(const X& x) { // of a number that counts operations: its value
        if constexpr (is_same<X, R>)
            return x;
        else
            return plain(x);
    }
    VI_HOT R now(const R& even, const R& odd) const { return select(at_odd_, odd, even); }

    // By value: what this read from elsewhere would have to stand in memory always.
    VI_RARE void keep(const Flow& flow, mask_t<R> which, R duration, detail::stop_hit<R> on) {
        const mask_t<R> alike =
            which & (duration <= flow.scan_length - flow.part()); // in the table
        const R place = only(alike, nearest(duration / flow.part()));
        const R beyond = only(alike, fnma(place, flow.part(), duration));
        const stored itself = flow.template later<nearby_order>(flow.pick(place), beyond);
        const auto put = [&](known_end<Flow>& to, const mask_t<R>& mine) VI_WITHIN {
            const auto take = [&](R& x, const R& y) VI_WITHIN { x = select(mine, y, x); };
            for (int i = 0; i < flow.dimension() + flow.blocks(); ++i)
                take(to.rows[i], itself[i]);
            take(to.time, duration);
            to.stop.take(mine, on, flow);
            to.ready = to.ready | mine;
        };
        put(even_, alike & !at_odd_);
        put(odd_, alike & at_odd_);
        knows_any_ = true;
    }

    R last_, before_; // how long the last flights took that were not recalled
    known_end<Flow> even_{}, odd_{};
    mask_t<R> at_odd_{}; // whose turn it is, where one is ready
    bool knows_any_ = false;
};

namespace detail {

// u, u' and u'' of a contact at one end of a flight.
template <class R>
struct flight_point {
    R u, slope, bend;
};

// Beginning of a flight: on a stop that a contact leaves at a known rate.
template <class R, class G, class Flow, int D>
VI_HOT flight_point<R> departure(const G& g, const Flow& flow, const vec<R, D>& y, const R& side,
                                 const R& rate) {
    R u = select(side > 0.0, R(g.upper), R(g.lower)), slope = -(side * rate);
    if (flow.contacts() > 1) {
        const mask_t<R> open = side == 0.0;
        u = select(open, guard_distance(g, y, flow), u);
        slope = select(open, guard_speed(g, y, flow), slope);
    }
    return {u, slope, guard_bend(g, y, flow)};
}

// End of a flight, y, for a contact that does not hit; `hit` is what is known of the one that does.
template <class R, class G, class Flow, int D>
VI_HOT flight_point<R> arrival(const G& g, const Flow& flow, const vec<R, D>& y,
                               const flight_point<R>& hit, const mask_t<R>& hits) {
    return {select(hits, hit.u, guard_distance(g, y, flow)),
            select(hits, hit.slope, guard_speed(g, y, flow)),
            select(hits, hit.bend, guard_bend(g, y, flow))};
}

// M t^6/43200 and the margin, for all t that a last step may make of `time`.
template <class R, class G, class Flow, int D>
VI_HOT R slack_of_flight(const G& g, const Flow& flow, const vec<R, D>& y, const R& time) {
    R sixth = g.least_sixth;
    flow.each_oscillator([&](auto j) VI_WITHIN {
        if (!flow.template drifts<R>(j)) sixth = fma(flow.growth[j], swing(g, flow, y, j), sixth);
    });
    const R square = time * time;
    const R most = (sixth * (1.0 / 43000)) * (square * square);
    return fma(most, square, proof_margin * terms_of(g, flow, y));
}

// (2); ends that are not on a stop have to keep away from the limits, too.
template <class R, class G>
VI_HOT mask_t<R> keeps_between(const G& g, const flight_point<R>& from, const flight_point<R>& to,
                               const R& t, const R& slack) {
    const R fifth = 0.2 * t, twentieth = (0.05 * t) * t;
    const R near = fma(fifth, from.slope, from.u), far = fnma(fifth, to.slope, to.u);
    const R leaving = fma(twentieth, from.bend, fma(fifth, from.slope, near));
    const R arriving = fma(twentieth, to.bend, fnma(fifth, to.slope, far));
    const R high = max(max(near, leaving), max(far, arriving));
    const R low = min(min(near, leaving), min(far, arriving));
    return (high < g.upper - slack) & (low > g.lower + slack);
}
template <class R, class G>
VI_HOT mask_t<R> is_between(const G& g, const R& u, const R& slack) {
    return (u < g.upper - slack) & (u > g.lower + slack);
}

// A flight along what is recalled.
template <class T, class Flow>
class repeated_flight {
    using R = real_t<T>;
    static constexpr int D = Flow::max_dimension;

public:
    stop_hit<R> hit;

    // To where the last one ended.
    template <class Mode, class Shape>
    VI_APART void go(const Mode& m, const flight_memory<Flow>& memory,
                     const trajectory<T, Shape>& start) {
        time_ = memory.time();
        const auto stop = memory.stop(m.flow);
        hit = {stop.contact, stop.side, stop.limit};
        y_ = m.flow.apply_stored([&](int i) VI_WITHIN { return memory.row(i); }, time_, start.y);
        u_ = expand_hit(m, values_of(y_, m.flow.dimension()), hit);
        scale_ = 1.0 / u_.slope;
    }
    // Onto the stop; y is the state there. Where that is proved:
    template <class Mode, class Shape>
    VI_APART mask_t<R> land(const Mode& m, const trajectory<T, Shape>& start, vec<T, D>& y,
                            T& duration, T& speed) {
        const last_step<R> on(u_.left, u_.bend, scale_, m.flow.step);
        y = m.flow.nudge(y_, on.shift);
        speed = speed_at(m, y, hit);
        duration = T(time_ + on.shift);
        const R bend = 2.0 * fma(3.0 * u_.twist, on.shift, u_.bend);
        const auto& z = values_of(y, m.flow.dimension());
        mask_t<R> proved = on.exact;
        const auto& x = values_of(start.y, m.flow.dimension());
        m.flow.each_contact([&](auto i) VI_WITHIN {
            const auto& g = m.guards[i];
            const auto from = departure(g, m.flow, x, start.touching[i], value(start.rate[i]));
            const R slack = slack_of_flight(g, m.flow, x, time_);
            const flight_point<R> end{hit.limit, value(speed), bend};
            if (m.flow.contacts() == 1) {
                proved = proved & keeps_between(g, from, end, value(duration), slack);
                return;
            }
            const mask_t<R> hits = hit.contact == static_cast<double>(i);
            const auto to = arrival(g, m.flow, z, end, hits);
            const mask_t<R> leaves = start.touching[i] != 0.0;
            proved = proved & keeps_between(g, from, to, value(duration), slack) &
                     (leaves | is_between(g, from.u, slack)) & (hits | is_between(g, to.u, slack));
        });
        return proved;
    }

private:
    R time_, scale_; // scale: 1 / u'
    vec<T, D> y_;
    expansion<R> u_;
};

} // namespace detail
} // namespace vi
