// The common flight, at the speed of a few hundred multiply-adds: all lanes at once.
//
// Method      A round looks ahead from where the flight is (event/lookahead.hpp) along a wide grid, and
//             past a stop that is near along a narrow one. Where all is clear the flight goes on to
//             its end by one stored propagator. Where it lands in the next interval, the root is
//             predicted by the cubic through four times of the grid; one stored propagator leads
//             next to it, the inverse series of the gap to within a millionth of a step         (1)
//             of it, and from the state there one step of third order with the gap onto it.     (2)
//             No elementary function is called.
//             Whatever is not proved this way (several contacts in an interval, slow departure, a
//             near graze, the horizon) is left to certified_flight, from where the flight got to.
// Assumes     the free mode of a modal flow, k >= 0, c >= 0; touching contacts leave: rate >= 0
// Accuracy    state: 8 ulp of the amplitude per round; time: the same divided by the rate
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/event/lookahead.hpp"

namespace vi {

inline constexpr double longest_flight =
    512.0; // steps: then certified_flight's ladder is more exact
// With c what (2) adds to (1): (2) is off by 2 (g'' c / 2 g')^2 c, less than 2^-52 steps.
inline constexpr double largest_correction = 0x1p-18; // c, of a step
inline constexpr double flattest = 0x1p-18;           // g'' c / 2 g'
inline constexpr int most_tries = 2;                  // more, to find the root from a better guess

// Where a flight has got to: onto a stop, if landed, to a place that is proved to be clear otherwise.
template <class T, class Shape>
struct quick_landing {
    using real = real_t<T>;
    mask_t<T> landed, moved;
    real contact, side;
    T duration, rate;
    vec<T, Shape::max_dimension> y;
};

namespace detail {

template <class M, class T, int D, class Shape>
VI_HOT void select_state(const M& mask, vec<T, D>& to, const vec<T, D>& from,
                         const sizes<Shape>& size) {
    size.each_coordinate([&](auto j) { to[j] = select(mask, from[j], to[j]); });
}

// Where in (0, 1) the cubic through four times of the grid, as Everett writes it, is so far above its
// value at 0: x = ahead / rise + x (1 - x) bend(x), bend(x) = b0 + b1 x, to third order in bend.
template <class R>
VI_HOT R crossing_point(const R& ahead, const R& rise, const R& bend0, const R& bend1) {
    const R scale = 1.0 / rise, sixth = (1.0 / 6) * scale;
    const R b0 = fma(2.0, bend0, bend1) * sixth, b1 = (bend1 - bend0) * sixth;
    const R x = ahead * scale, width = fnma(x, x, x), bend = fma(b1, x, b0);
    const R slope = fma(width, b1, bend * fnma(2.0, x, 1.0));
    return fma(width * bend, fma(slope, slope, 1.0 + slope), x);
}

// What watch(guard) says of the contact of the crossing.
template <class T, class Mode, class R, class Watch>
VI_HOT T watch_hit(const Mode& m, const sight<R>& hit, const Watch& watch) {
    T u = watch(m.guards[0]);
    for (int i = 1; i < m.flow.contacts(); ++i)
        u = select(hit.contact == static_cast<double>(i), watch(m.guards[i]), u);
    return u;
}

// How much is left to the limit, in u; and u'.
template <class T, class Mode, class R, int D>
VI_HOT T left_to(const Mode& m, const vec<T, D>& y, const sight<R>& hit) {
    return hit.limit - watch_hit<T>(m, hit, [&](const auto& g) VI_WITHIN {
               return watch_distance(g, y, m.flow);
           });
}
template <class T, class Mode, class R, int D>
VI_HOT T speed_at(const Mode& m, const vec<T, D>& y, const sight<R>& hit) {
    return watch_hit<T>(m, hit, [&](const auto& g) VI_WITHIN { return watch_speed(g, y, m.flow); });
}

// Near a root: what is left to the limit, and the next Taylor coefficients of u.
template <class R>
struct expansion {
    R left, slope, bend, twist;
};
template <class R, class Mode, int D>
VI_HOT expansion<R> expand_hit(const Mode& m, const vec<R, D>& y, const sight<R>& hit) {
    auto bending = watch_bending(m.guards[0], y, m.flow);
    for (int i = 1; i < m.flow.contacts(); ++i) {
        const auto other = watch_bending(m.guards[i], y, m.flow);
        const mask_t<R> mine = hit.contact == static_cast<double>(i);
        for (int k = 0; k < 2; ++k)
            bending[k] = select(mine, other[k], bending[k]);
    }
    return {left_to(m, y, hit), speed_at(m, y, hit), bending[0], bending[1]};
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

// A state of the table next to the root, so many parts of a step on, and the root beyond it. Where
// no crossing was found, the state is where the flight goes on to, and s is zero.
template <class T, class R, int D>
struct neighbour {
    R part;
    vec<T, D> y;
    expansion<R> u;
    R s;
    mask_t<R> close;

    template <class Mode>
    VI_HOT void go(const Mode& m, const vec<T, D>& from, const sight<R>& hit) {
        y = m.flow.apply_ahead(part, from);
        u = expand_hit(m, values_of(y, m.flow.dimension()), hit);
    }
    template <class Mode>
    VI_HOT void predict(const Mode& m, const sight<R>& hit) {
        s = only(hit.found, nearby_root(u));
        close = abs(s) <= nearby * m.flow.step;
    }
};

// The whole number nearest to x in [0, 2^51].
template <class R>
VI_HOT R nearest(const R& x) {
    return (x + 0x1.8p52) - 0x1.8p52;
}
// The same within the table; 0 for NaN.
template <class R>
VI_HOT R nearest_place(const R& x) {
    return nearest(min(max(R(0.0), x), R(places - 1.0)));
}

// From a better guess, for lanes that were not close.
template <class T, class Mode, class R, int D>
VI_HOT void go_nearer(const Mode& m, const vec<T, D>& y, const sight<R>& hit,
                      neighbour<T, R, D>& near) {
    for (int tries = 0; tries < most_tries && any(!near.close); ++tries) {
        const R better = nearest_place(near.part + near.s / m.flow.part());
        near.part = select(near.close, near.part, better);
        near.go(m, y, hit);
        near.predict(m, hit);
    }
}

// Where the inverse series leads to, and what is left there.
template <class T, class R, int D>
struct prediction {
    vec<T, D> y;
    R left, scale; // scale: 1 / u'
};
template <class T, class Mode, class R, int D>
VI_HOT void go_on_series(const Mode& m, const sight<R>& hit, const neighbour<T, R, D>& near,
                         prediction<T, R, D>& to) {
    to.y = m.flow.template short_flight<nearby_order>(near.y, near.s);
    const auto& z = values_of(to.y, m.flow.dimension());
    to.left = left_to(m, z, hit);
    to.scale = 1.0 / speed_at(m, z, hit);
}

// (2): every lane that has found a crossing lands, or stays where it is if that is not proved; those
// that go on move.
template <class T, class Mode, class Shape>
VI_HOT void land(const Mode& m, const sight<real_t<T>>& hit,
                 const neighbour<T, real_t<T>, Shape::max_dimension>& near,
                 const prediction<T, real_t<T>, Shape::max_dimension>& at,
                 quick_landing<T, Shape>& out) {
    using R = real_t<T>;
    const auto& flow = m.flow;
    const R part = flow.part(), miss = at.left * at.scale;
    const R turn = fma(3.0 * near.u.twist, near.s, near.u.bend) * at.scale;
    const R shift = only(hit.found, miss * fnma(turn, miss, 1.0));
    const R s = near.s + shift, begin = (hit.begin - near.part) * part;
    out.landed = hit.found & near.close & (abs(shift) <= largest_correction * flow.step) &
                 (abs(turn * shift) <= flattest) & (s >= begin) &
                 (s <= fma(hit.length, part, begin));
    out.contact = hit.contact;
    out.side = hit.side;
    const auto end = flow.nudge(at.y, shift);
    out.rate = -hit.side * speed_at(m, end, hit);
    const mask_t<R> gone = out.landed | out.moved;
    if (all(gone))
        flow.each_coordinate([&](auto j) VI_WITHIN { out.y[j] = end[j]; });
    else
        select_state(gone, out.y, end, flow);
    out.duration = select(gone, (out.duration + near.part * part) + s, out.duration);
}

// Series cut off cost jets some digits of their derivatives: dt = -dg / g' again, exactly.
template <class T, class Mode, class Shape>
VI_HOT void sharpen(const Mode& m, const sight<real_t<T>>& hit, quick_landing<T, Shape>& at) {
    const T gap = hit.side * left_to(m, at.y, hit);
    const T shift = with_value(-gap / value(at.rate), real_t<T>(0.0));
    select_state(at.landed, at.y, m.flow.template short_flight<3>(at.y, shift), m.flow);
    at.duration = select(at.landed, at.duration + shift, at.duration);
    at.rate = with_value(-hit.side * speed_at(m, at.y, hit), value(at.rate));
}

// What the wide grid left undecided, seen along the narrow one from the state y, so much later.
template <class T, class R, int D>
struct closer_look {
    sight<R> seen;
    vec<T, D> y;
};
template <class T, class Mode, class R, int D, int K>
VI_HOT void look_closer(const Mode& m, const R& before, const vec<T, D>& y, vec<outlook<R>, K> from,
                        closer_look<T, R, D>& close) {
    close.y = m.flow.apply_ahead(before, y);
    const auto& z = values_of(close.y, m.flow.dimension());
    for (int i = 0; i < m.flow.contacts(); ++i)
        from[i].u = select(before == 0.0, from[i].u, watch_distance(m.guards[i], z, m.flow));
    look_along<1>(m, from, z, close.seen);
}

template <class R>
VI_HOT void select_sight(const mask_t<R>& mask, sight<R>& to, const sight<R>& from) {
    const auto take = [&](R& x, const R& y) { x = select(mask, y, x); };
    take(to.begin, from.begin);
    take(to.length, from.length);
    take(to.contact, from.contact);
    take(to.side, from.side);
    take(to.limit, from.limit);
    take(to.u0, from.u0);
    take(to.rise, from.rise);
    take(to.bend0, from.bend0);
    take(to.bend1, from.bend1);
    to.found = to.found | (mask & from.found);
}

} // namespace detail

// One round of every lane that is going: look(), then stages. Packs of lanes take turns at each: one
// works while the results of another are on their way.
template <class T, class Mode, class Shape>
class quick_round {
    using R = real_t<T>;
    using landing = quick_landing<T, Shape>;
    static constexpr int D = Shape::max_dimension, K = Shape::max_contacts;

public:
    // The flight stands at at.y, at.duration after its start.
    VI_HOT quick_round(const Mode& m, landing& at) : m_(m), at_(at) {}
    quick_round(const quick_round&) = delete; // of another's mode and flight
    quick_round& operator=(const quick_round&) = delete;

    // Along the wide grid; `touching` and `rate` tell the stops that the flight leaves there.
    VI_HOT void look(const vec<R, K>& touching, const vec<T, K>& rate, const mask_t<T>& able) {
        const auto& y = values_of(at_.y, m_.flow.dimension());
        going_ = able;
        for (int i = 0; i < m_.flow.contacts(); ++i) {
            from_[i] = detail::look_out(m_.guards[i], m_.flow, y, touching[i]);
            going_ = going_ & ((touching[i] == 0.0) | (value(rate[i]) > 0.0)) &
                     (from_[i].u <= m_.guards[i].upper) & (from_[i].u >= m_.guards[i].lower);
        }
        detail::look_along<0>(m_, from_, y, seen_);
    }
    // The stages that follow, in order: take(stage), each to be called with the round.
    template <class Take>
    VI_HOT static void each_stage(const Take& take) {
        take([](auto& round) VI_WITHIN { round.look_again(); });
        take([](auto& round) VI_WITHIN { round.aim(); });
        take([](auto& round) VI_WITHIN { round.approach(); });
        take([](auto& round) VI_WITHIN { round.predict(); });
        take([](auto& round) VI_WITHIN { round.close_in(); });
        take([](auto& round) VI_WITHIN { round.land(); });
    }

private:
    // Along the narrow one, where something is undecided.
    VI_HOT void look_again() {
        const mask_t<T> stuck =
            going_ & !seen_.found & (seen_.clear < double(detail::grid_intervals));
        if (!any(stuck)) return;
        const R before = only(stuck, seen_.begin);
        detail::closer_look<T, R, D> close;
        detail::look_closer(m_, before, at_.y, from_, close);
        at_.duration = at_.duration + before * m_.flow.part();
        const mask_t<T> advanced = stuck & (before > 0.0); // the others are there
        detail::select_state(advanced, at_.y, close.y, m_.flow);
        detail::select_sight(stuck, seen_, close.seen);
    }
    // At the crossing, or at the end of what is clear.
    VI_HOT void aim() {
        const R x =
            detail::crossing_point(seen_.limit - seen_.u0, seen_.rise, seen_.bend0, seen_.bend1);
        const R crossing = detail::nearest_place(fma(seen_.length, x, seen_.begin));
        seen_.found = seen_.found & going_;
        near_.part = only(going_, select(seen_.found, crossing, seen_.begin));
    }
    VI_HOT void approach() { near_.go(m_, at_.y, seen_); }
    VI_HOT void predict() { near_.predict(m_, seen_); }
    VI_HOT void close_in() {
        detail::go_nearer(m_, at_.y, seen_, near_);
        detail::go_on_series(m_, seen_, near_, predicted_);
    }
    VI_HOT void land() {
        at_.moved = going_ & !seen_.found & (seen_.begin > 0.0);
        detail::land(m_, seen_, near_, predicted_, at_);
        if constexpr (scalar_traits<T>::is_jet) detail::sharpen(m_, seen_, at_);
    }

    const Mode& m_;
    landing& at_;
    mask_t<T> going_;
    vec<detail::outlook<R>, K> from_;
    detail::sight<R> seen_;
    detail::neighbour<T, R, D> near_;
    detail::prediction<T, R, D> predicted_;
};

// Whether the times that a round looks at are within the horizon of a flight that began `flown` ago.
template <class R, class Flow>
VI_HOT mask_t<R> may_go_on(const Flow& flow, const R& flown, const R& horizon) {
    constexpr double grid_steps = double(grid_parts[0] * grid_times) / parts_of_step;
    return fma(flow.step, grid_steps, flown) <= min(horizon, R(longest_flight * flow.step));
}

// A whole flight of one lane.
template <class T, class Mode, class Shape>
VI_HOT quick_landing<T, Shape> quick_flight(const Mode& m, const trajectory<T, Shape>& start,
                                            const real_t<T>& horizon) {
    quick_landing<T, Shape> out;
    out.y = start.y;
    out.duration = T(0.0);
    out.landed = out.moved = false;
    auto touching = start.touching;
    while (may_go_on(m.flow, value(out.duration), horizon)) {
        quick_round<T, Mode, Shape> round(m, out);
        round.look(touching, start.rate, true);
        round.each_stage([&](const auto& stage) VI_WITHIN { stage(round); });
        if (!out.moved) break;
        for (int i = 0; i < m.flow.contacts(); ++i)
            touching[i] = real_t<T>(0.0);
    }
    return out;
}

} // namespace vi
