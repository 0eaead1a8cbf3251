// The common flight, at the speed of a few hundred multiply-adds: all lanes at once.
//
// Method      A round scans the time ahead (search/grid/grid_bounds.hpp) along a wide grid, and where that
//             leaves something undecided along a narrow one. Where all is clear the flight goes on to
//             its end by one stored propagator. Where it lands in the next interval, the root is
//             predicted by the cubic through four times of the grid; one stored propagator leads
//             next to it, the inverse series of the gap to within a millionth of a step         (1)
//             of it, and from the state there one step of third order with the gap onto it.     (2)
//             No elementary function is called. A flight that is like the one before last is not
//             scanned, but repeated (search/grid/recall_period.hpp).
//             Whatever is not proved this way (several contacts in an interval, slow departure, a
//             near graze, the horizon) is left to certified_flight, from where the flight got to.
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; touching contacts leave: rate >= 0
// Accuracy    state: 8 ulp of the amplitude per round; time: the same divided by the rate
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/search/grid/recall_period.hpp"

namespace vi {

inline constexpr double longest_flight = 512.0; // steps: then the refreshed march is more exact
inline constexpr int most_tries = 2;            // more, to find the root from a better guess
inline constexpr int applications_of_round = 2; // that add as much as a round: 4 ulp each

// Result of a round: it brought the trajectory onto a stop, or moved it to a place up to which
// all is clear. `duration` is that of the flight up to there.
template <class T>
struct quick_landing {
    mask_t<T> landed, moved;
    T duration, speed; // u' at the stop
    detail::stop_hit<real_t<T>> stop;
};

namespace detail {

template <class M, class T, int D, class Shape>
VI_HOT void select_state(const M& mask, vec<T, D>& to, const vec<T, D>& from,
                         const sizes<Shape>& size) {
    size.each_coordinate([&](auto j) { to[j] = select(mask, from[j], to[j]); });
}

// (1) to its third power, and one Newton step on the cubic: its slope g1 (1 + q) is divided by as
// 1 - q + q^2.
template <class R>
VI_HOT R nearby_root(const expansion<R>& u) {
    const R scale = 1.0 / u.slope;
    const R e = u.left * scale, a = u.bend * scale, b = u.twist * scale;
    const R s = e * fnma(e, fnma(e, fma(2.0 * a, a, -b), a), 1.0);
    const R miss = fma(s, fma(s, fma(s, b, a), 1.0), -e), q = s * fma(3.0 * s, b, 2.0 * a);
    return fnma(miss, fma(q, q, 1.0 - q), s);
}

// The state at the place of the table that a scan named, and the root next to it, to which it then
// goes. Where no crossing was found, it is where the flight goes on to, and s is zero.
template <class T, class R, int D>
struct neighbour {
    vec<T, D> y;
    expansion<R> u;
    R s;
    mask_t<R> close;

    template <class Mode>
    VI_HOT void go(const Mode& m, const vec<T, D>& from, const scan_result<R>& hit) {
        y = m.flow.apply_ahead(hit.place, from);
        u = expand_hit(m, values_of(y, m.flow.dimension()), hit.stop);
    }
    template <class Mode>
    VI_HOT void predict(const Mode& m, const scan_result<R>& hit) {
        s = only(hit.found, nearby_root(u));
        close = abs(s) <= nearby * m.flow.step;
    }
};

// From a better guess, for lanes that were not close.
template <class T, class Mode, class R, int D>
VI_RARE void improve_guess(const Mode& m, const vec<T, D>& y, scan_result<R>& hit,
                           neighbour<T, R, D>& near) {
    for (int tries = 0; tries < most_tries && any(!near.close); ++tries) {
        const R better = nearest_place(hit.place + near.s / m.flow.part());
        hit.place = select(near.close, hit.place, better);
        near.go(m, y, hit);
        near.predict(m, hit);
    }
}

// Distance that is left when the state has gone by s.
template <class R>
struct prediction {
    R left, scale; // scale: 1 / u'
};
template <class T, class Mode, class R, int D>
VI_HOT void step_by_series(const Mode& m, const scan_result<R>& hit, neighbour<T, R, D>& near,
                           prediction<R>& to) {
    near.y = m.flow.template short_flight<nearby_order>(near.y, near.s);
    const auto& z = values_of(near.y, m.flow.dimension());
    to.left = left_to(m, z, hit.stop);
    to.scale = 1.0 / speed_at(m, z, hit.stop);
}

// Whether all contacts but the one that hits are between their limits.
template <class Mode, class R, int D>
VI_RARE mask_t<R> is_first(const Mode& m, const vec<R, D>& y, const stop_hit<R>& hit) {
    mask_t<R> out = mask_t<R>(true);
    m.flow.each_contact([&](auto i) VI_WITHIN {
        out = out & ((hit.contact == static_cast<double>(i)) | is_inside(m.guards[i], m.flow, y));
    });
    return out;
}

// (2): every lane that has found a crossing lands, or stays where it is if that is not proved; those
// that go on move.
template <class T, class Mode, int D>
VI_HOT void land(const Mode& m, const neighbour<T, real_t<T>, D>& near,
                 const prediction<real_t<T>>& at, const scan_result<real_t<T>>& hit,
                 const vec<T, D>& start, const T& flown, quick_landing<T>& out, vec<T, D>& y) {
    using R = real_t<T>;
    const auto& flow = m.flow;
    R bend = fma(3.0 * near.u.twist, near.s, near.u.bend);
    if constexpr (Mode::flow_type::
                      several_may_cross) // what states follow is asked of the place itself
        bend = 0.5 * bend_at<R>(m, values_of(near.y, flow.dimension()), hit.stop);
    const R part = flow.part();
    const last_step<R> on(at.left, bend, at.scale, flow.step);
    const R shift = only(hit.found, on.shift);
    const R s = near.s + shift, begin = (hit.begin - hit.place) * part;
    out.landed =
        hit.found & near.close & on.exact & (s >= begin) & (s <= fma(hit.length, part, begin));
    y = flow.nudge(near.y, shift);
    if constexpr (Mode::flow_type::several_may_cross) {
        // another may be due within rounding, also just beyond the end of the interval
        const mask_t<R> asked =
            hit.several | (s >= fma(hit.length, part, begin) - beyond_step * flow.step);
        if (any(asked & out.landed))
            out.landed =
                out.landed & (!asked | is_first(m, values_of(y, flow.dimension()), hit.stop));
    }
    out.speed = speed_at(m, y, hit.stop);
    const mask_t<R> gone = out.landed | out.moved;
    if (!all(gone)) select_state(!gone, y, start, flow);
    out.duration = select(gone, (flown + hit.place * part) + s, flown);
}

// Series cut off cost jets some digits of their derivatives: dt = -dg / g' again, exactly.
template <class T, class Mode, int D>
VI_HOT void sharpen(const Mode& m, vec<T, D>& y, quick_landing<T>& at) {
    const auto& hit = at.stop;
    const T shift = with_value(left_to(m, y, hit) / value(at.speed), real_t<T>(0.0));
    select_state(at.landed, y, m.flow.template short_flight<3>(y, shift), m.flow);
    at.duration = select(at.landed, at.duration + shift, at.duration);
    at.speed = with_value(speed_at(m, y, hit), value(at.speed));
}

// From the state y along the narrow grid.
template <class R, class Mode, int D, int K>
VI_RARE void scan_narrow_grid(const Mode& m, const vec<R, D>& y, const vec<R, K>& touching,
                              scan_type<Mode, R, K>& narrow) {
    narrow.scan(m, narrow_grid, y, touching);
    narrow.cross(m);
}

template <class R, class Shape>
VI_HOT void select_result(const mask_t<R>& mask, scan_result<R>& to, const scan_result<R>& from,
                          const sizes<Shape>& size) {
    const auto take = [&](R& x, const R& y) { x = select(mask, y, x); };
    take(to.begin, from.begin);
    take(to.length, from.length);
    take(to.place, from.place);
    to.stop.take(mask, from.stop, size);
    to.found = to.found | (mask & from.found);
    to.several = (to.several & (!mask)) | (mask & from.several);
}

// The limit that is hit.
template <class Mode, class R>
VI_HOT R limit_of(const Mode& m, const stop_hit<R>& hit) {
    const auto on = [&](const auto& g)
                        VI_WITHIN { return select(hit.side < 0.0, R(g.lower), R(g.upper)); };
    return value_at_hit<R>(m, hit, on);
}

} // namespace detail

// Where registers hold the results of a stage, a flight that is repeated has one stage only: to store
// these for later costs more than to wait for them.
template <class T>
inline constexpr bool many_registers = scalar_traits<T>::lanes == 8;

// One round of every lane that is going: begin(), where it scans() scan() and evaluate(), then stages. Packs of
// lanes take turns at each: one works while the results of another are on their way.
template <class T, class Mode, class Shape>
class quick_round {
    using R = real_t<T>;
    using memory_type = flight_memory<typename Mode::flow_type>;
    static constexpr int D = Shape::max_dimension, K = Shape::max_contacts;
    using repeated = detail::repeated_flight<T, typename Mode::flow_type>;
    static constexpr bool remembers = memory_type::remembers;

public:
    // The flight stands at at.y, `flown` after its start.
    VI_HOT quick_round(const Mode& m, trajectory<T, Shape>& at, T& flown, memory_type& memory)
        : m_(&m), at_(at), flown_(flown), memory_(memory) {}
    quick_round(const quick_round&) = delete; // of another's mode and flight
    quick_round& operator=(const quick_round&) = delete;

    // Decides which lanes fly as recalled, and which by a scan along the wide grid.
    VI_HOT void begin(const mask_t<T>& able) {
        scans_ = true;
        repeats_ = false;
        if constexpr (remembers) repeats_ = memory_.knows_any();
        if (!repeats_) return depart(able);
        if constexpr (remembers) begin_recalled(able);
    }
    VI_HOT bool scans() const { return scans_; }
    // Along the wide grid; then what happens in the interval that is not clear.
    VI_HOT void scan() {
        wide_.scan(m(), wide_grid, values_of(at_.y, m().flow.dimension()), at_.touching);
    }
    VI_HOT void evaluate() {
        auto& result = wide_.result;
        wide_.cross(m());
        result.found = result.found & going_;
        result.place = only(going_, result.place); // an idle lane may have a table of one entry
        stuck_ = going_ & !result.found & !result.clear;
        if (any(stuck_)) scan_again();
        result.stop.limit = detail::limit_of(m(), result.stop);
    }
    // The stages that follow but the last, in order: take(stage), each to be called with the round.
    template <class Take>
    VI_HOT static void each_stage(const Take& take) {
        take([](auto& round) VI_WITHIN {
            if (round.scans_) round.approach();
        });
        take([](auto& round) VI_WITHIN {
            if (round.scans_) round.predict();
        });
        take([](auto& round) VI_WITHIN {
            if (round.scans_) round.close_in();
            if constexpr (remembers && !many_registers<T>)
                if (round.repeats_) round.go_as_recalled(round.again_);
        });
    }
    // The last one: `y` is the state after it. Some = repeats().
    template <bool Some>
    VI_HOT void land(quick_landing<T>& end, vec<T, D>& y) {
        static_assert(remembers || !Some);
        if (!Some || scans_) {
            end.stop = wide_.result.stop;
            end.moved = going_ & !wide_.result.found & (wide_.result.begin > 0.0);
            detail::land(m(), near_, predicted_, wide_.result, at_.y, flown_, end, y);
        }
        if constexpr (Some) {
            if constexpr (many_registers<T>) {
                repeated again;
                go_as_recalled(again);
                repeat(again, end, y);
            } else {
                repeat(again_, end, y);
            }
        }
        if constexpr (scalar_traits<T>::is_jet) detail::sharpen(m(), y, end);
        if constexpr (remembers) remember<Some>(end);
    }
    VI_HOT bool repeats() const { return repeats_; }
    // Lanes that did not fly as recalled: in the next round they scan.
    VI_HOT mask_t<T> failed_recall(const quick_landing<T>& end) const {
        return recalled_ & !end.landed;
    }

    // Leaves all lanes out.
    VI_HOT void rest() { scans_ = repeats_ = false; }
    // The mode that lanes are in, where it is another from round to round.
    VI_HOT void use(const Mode& m) { m_ = &m; }

private:
    VI_HOT const Mode& m() const { return *m_; }
    VI_HOT void begin_recalled(const mask_t<T>& able) {
        recalled_ = able & memory_.ready() & (value(flown_) == 0.0);
        repeats_ = any(recalled_);
        const mask_t<T> others = able & !recalled_;
        scans_ = !repeats_ || any(others);
        if (scans_) depart(others);
    }
    VI_HOT void depart(const mask_t<T>& able) {
        mask_t<T> going = able;
        m().flow.each_contact([&](auto i) VI_WITHIN {
            going = going & ((at_.touching[i] == 0.0) | (value(at_.rate[i]) > 0.0));
        });
        going_ = going;
    }
    // Along the narrow one, where something is undecided.
    VI_RARE void scan_again() {
        const R before = only(stuck_, wide_.result.begin);
        const auto y = m().flow.apply_ahead(before, at_.y);
        const mask_t<R> here = before == 0.0;
        vec<R, K> touching;
        for (int i = 0; i < m().flow.contacts(); ++i)
            touching[i] = only(here, at_.touching[i]);
        detail::scan_type<Mode, R, K> close;
        detail::scan_narrow_grid(m(), values_of(y, m().flow.dimension()), touching, close);
        // lanes that never were in this mode have no steps of it: what stands there may be NaN
        flown_ = flown_ + only(stuck_, before * m().flow.part());
        detail::select_state(stuck_ & !here, at_.y, y, m().flow); // the others are there
        detail::select_result(stuck_, wide_.result, close.result, m().flow);
    }
    // Next to the crossing, or to the end of what is clear.
    VI_HOT void approach() { near_.go(m(), at_.y, wide_.result); }
    VI_HOT void predict() { near_.predict(m(), wide_.result); }
    VI_HOT void close_in() {
        if (!all(near_.close)) detail::improve_guess(m(), at_.y, wide_.result, near_);
        detail::step_by_series(m(), wide_.result, near_, predicted_);
    }
    VI_HOT void go_as_recalled(repeated& flight) { flight.go(m(), memory_, at_); }
    VI_HOT void repeat(repeated& flight, quick_landing<T>& end, vec<T, D>& y) {
        const auto& hit = flight.hit;
        T duration, speed;
        if (!scans_) {
            const mask_t<T> landed = recalled_ & flight.land(m(), at_, y, duration, speed);
            end.landed = landed;
            end.moved = mask_t<T>(false);
            end.duration = duration;
            if (!all(landed)) {
                detail::select_state(!landed, y, at_.y, m().flow);
                end.duration = select(landed, duration, flown_);
            }
            end.speed = speed;
            end.stop = hit;
            return;
        }
        vec<T, D> there;
        const mask_t<T> landed = recalled_ & flight.land(m(), at_, there, duration, speed);
        const auto take = [&](auto& to, const auto& x) VI_WITHIN { to = select(landed, x, to); };
        detail::select_state(landed, y, there, m().flow);
        end.landed = end.landed | landed;
        take(end.duration, duration);
        take(end.speed, speed);
        end.stop.take(landed, hit, m().flow);
    }
    template <bool Some>
    VI_HOT void remember(const quick_landing<T>& end) {
        mask_t<T> fresh = end.landed;
        if constexpr (Some) {
            const mask_t<T> lost = failed_recall(end);
            if (any(lost)) memory_.drop(lost);
            fresh = fresh & !recalled_;
        }
        if (!Some || scans_)
            memory_.template note<T>(m().flow, fresh, value(end.duration), end.stop);
        if (memory_.knows_any()) memory_.take_turns(end.landed);
    }

    const Mode* m_;
    trajectory<T, Shape>& at_;
    T& flown_;
    memory_type& memory_;
    mask_t<T> going_, stuck_, recalled_;
    bool scans_, repeats_; // whether any lane does
    detail::scan_type<Mode, R, K> wide_;
    detail::neighbour<T, R, D> near_;
    detail::prediction<R> predicted_;
    repeated again_;
};

// Whether the times that a round scans are within the horizon of a flight that began `flown` ago.
template <class R, class Flow>
VI_HOT mask_t<R> may_go_on(const Flow& flow, const R& flown, const R& horizon) {
    return flown + flow.scan_length <= min(horizon, R(longest_flight * flow.step));
}

// Rounds of a flight, and how many applications of a propagator they are worth.
template <class T>
struct quick_leg {
    quick_landing<T> end;
    int applications;
};

// The rest of a flight of one lane that began `flown` ago, or as much of it as is proved.
template <class T, class Mode, class Shape>
VI_HOT quick_leg<T> quick_flight(const Mode& m, trajectory<T, Shape>& at, T flown,
                                 const real_t<T>& horizon,
                                 flight_memory<typename Mode::flow_type>& memory) {
    quick_leg<T> leg{};
    auto& end = leg.end;
    end.duration = flown;
    while (may_go_on(m.flow, value(flown), horizon)) {
        quick_round<T, Mode, Shape> round(m, at, flown, memory);
        round.begin(true);
        if (round.scans()) {
            round.scan();
            round.evaluate();
        }
        round.each_stage([&](const auto& stage) VI_WITHIN { stage(round); });
        vec<T, Shape::max_dimension> y;
        if (!round.repeats())
            round.template land<false>(end, y);
        else if constexpr (flight_memory<typename Mode::flow_type>::remembers)
            round.template land<true>(end, y);
        at.y = y;
        flown = end.duration;
        if (end.moved) leg.applications += applications_of_round;
        if (!end.moved && !(round.repeats() && round.failed_recall(end))) break;
        for (int i = 0; end.moved && i < m.flow.contacts(); ++i)
            at.touching[i] = real_t<T>(0.0);
    }
    return leg;
}

} // namespace vi
