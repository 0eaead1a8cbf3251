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

// What a round saw and did: it brought the trajectory onto a stop, or moved it to a place up to which
// all is clear. `duration` is that of the flight up to there.
template <class T>
struct quick_landing {
    detail::sight<real_t<T>> seen;
    mask_t<T> landed, moved;
    T duration, rate;
};

namespace detail {

template <class M, class T, int D, class Shape>
VI_HOT void select_state(const M& mask, vec<T, D>& to, const vec<T, D>& from,
                         const sizes<Shape>& size) {
    size.each_coordinate([&](auto j) { to[j] = select(mask, from[j], to[j]); });
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
    auto u = expand(m.guards[0], y, m.flow);
    for (int i = 1; i < m.flow.contacts(); ++i) {
        const auto other = expand(m.guards[i], y, m.flow);
        const mask_t<R> mine = hit.contact == static_cast<double>(i);
        for (int k = 0; k < 4; ++k)
            u[k] = select(mine, other[k], u[k]);
    }
    return {hit.limit - u[0], u[1], u[2], u[3]};
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
template <class T, class Mode, int D>
VI_HOT void land(const Mode& m, const neighbour<T, real_t<T>, D>& near,
                 const prediction<T, real_t<T>, D>& at, const vec<T, D>& start,
                 quick_landing<T>& out, vec<T, D>& y) {
    using R = real_t<T>;
    const auto& flow = m.flow;
    const auto& hit = out.seen;
    const R part = flow.part(), miss = at.left * at.scale;
    const R turn = fma(3.0 * near.u.twist, near.s, near.u.bend) * at.scale;
    const R shift = only(hit.found, miss * fnma(turn, miss, 1.0));
    const R s = near.s + shift, begin = (hit.begin - near.part) * part;
    out.landed = hit.found & near.close & (abs(shift) <= largest_correction * flow.step) &
                 (abs(turn * shift) <= flattest) & (s >= begin) &
                 (s <= fma(hit.length, part, begin));
    y = flow.nudge(at.y, shift);
    out.rate = -hit.side * speed_at(m, y, hit);
    const mask_t<R> gone = out.landed | out.moved;
    if (!all(gone)) select_state(!gone, y, start, flow);
    out.duration = select(gone, (out.duration + near.part * part) + s, out.duration);
}

// Series cut off cost jets some digits of their derivatives: dt = -dg / g' again, exactly.
template <class T, class Mode, int D>
VI_HOT void sharpen(const Mode& m, vec<T, D>& y, quick_landing<T>& at) {
    const auto& hit = at.seen;
    const T gap = hit.side * left_to(m, y, hit);
    const T shift = with_value(-gap / value(at.rate), real_t<T>(0.0));
    select_state(at.landed, y, m.flow.template short_flight<3>(y, shift), m.flow);
    at.duration = select(at.landed, at.duration + shift, at.duration);
    at.rate = with_value(-hit.side * speed_at(m, y, hit), value(at.rate));
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
    take(to.place, from.place);
    take(to.contact, from.contact);
    take(to.side, from.side);
    take(to.limit, from.limit);
    to.found = to.found | (mask & from.found);
}

} // namespace detail

// One round of every lane that is going: look(), then stages. Packs of lanes take turns at each: one
// works while the results of another are on their way.
template <class T, class Mode, class Shape>
class quick_round {
    using R = real_t<T>;
    static constexpr int D = Shape::max_dimension, K = Shape::max_contacts;
    using outlooks = vec<detail::outlook<R>, K>;

public:
    // The flight stands at at.y, end.duration after its start.
    VI_HOT quick_round(const Mode& m, trajectory<T, Shape>& at, quick_landing<T>& end)
        : m_(m), at_(at), end_(end) {}
    quick_round(const quick_round&) = delete; // of another's mode and flight
    quick_round& operator=(const quick_round&) = delete;

    // Along the wide grid.
    VI_HOT void look(const mask_t<T>& able) {
        const auto& y = values_of(at_.y, m_.flow.dimension());
        outlooks from;
        look_out(y, from);
        mask_t<T> going = able;
        m_.flow.each_contact([&](auto i) VI_WITHIN {
            going = going & ((at_.touching[i] == 0.0) | (value(at_.rate[i]) > 0.0)) &
                    (from[i].u <= m_.guards[i].upper) & (from[i].u >= m_.guards[i].lower);
        });
        const mask_t<T> clear = detail::look_along<0>(m_, from, y, end_.seen);
        const mask_t<T> found = end_.seen.found & going;
        stuck_ = going & !found & !clear;
        end_.seen.found = found;
        going_ = going;
    }
    // The stages that follow but the last, in order: take(stage), each to be called with the round.
    template <class Take>
    VI_HOT static void each_stage(const Take& take) {
        take([](auto& round) VI_WITHIN { round.look_again(); });
        take([](auto& round) VI_WITHIN { round.approach(); });
        take([](auto& round) VI_WITHIN { round.predict(); });
        take([](auto& round) VI_WITHIN { round.close_in(); });
    }
    // The last one: `y` is the state after it.
    VI_HOT void land(vec<T, D>& y) {
        end_.moved = going_ & !end_.seen.found & (end_.seen.begin > 0.0);
        detail::land(m_, near_, predicted_, at_.y, end_, y);
        if constexpr (scalar_traits<T>::is_jet) detail::sharpen(m_, y, end_);
    }

private:
    VI_HOT void look_out(const vec<R, D>& y, outlooks& from) const {
        m_.flow.each_contact([&](auto i) VI_WITHIN {
            from[i] = detail::look_out(m_.guards[i], m_.flow, y, at_.touching[i]);
        });
    }
    // Along the narrow one, where something is undecided.
    VI_HOT void look_again() {
        if (!any(stuck_)) return;
        const R before = only(stuck_, end_.seen.begin);
        detail::closer_look<T, R, D> close;
        outlooks from;
        look_out(values_of(at_.y, m_.flow.dimension()), from);
        detail::look_closer(m_, before, at_.y, from, close);
        end_.duration = end_.duration + before * m_.flow.part();
        const mask_t<T> advanced = stuck_ & (before > 0.0); // the others are there
        detail::select_state(advanced, at_.y, close.y, m_.flow);
        detail::select_sight(stuck_, end_.seen, close.seen);
    }
    // Next to the crossing, or to the end of what is clear.
    VI_HOT void approach() {
        const auto& seen = end_.seen;
        const R crossing = detail::nearest_place(seen.place);
        near_.part = only(going_, select(seen.found, crossing, seen.begin));
        near_.go(m_, at_.y, seen);
    }
    VI_HOT void predict() { near_.predict(m_, end_.seen); }
    VI_HOT void close_in() {
        detail::go_nearer(m_, at_.y, end_.seen, near_);
        detail::go_on_series(m_, end_.seen, near_, predicted_);
    }

    const Mode& m_;
    trajectory<T, Shape>& at_;
    quick_landing<T>& end_;
    mask_t<T> going_, stuck_;
    detail::neighbour<T, R, D> near_;
    detail::prediction<T, R, D> predicted_;
};

// Whether the times that a round looks at are within the horizon of a flight that began `flown` ago.
template <class R, class Flow>
VI_HOT mask_t<R> may_go_on(const Flow& flow, const R& flown, const R& horizon) {
    return flown + flow.sight <= min(horizon, R(longest_flight * flow.step));
}

// A whole flight of one lane, or as much of it as is proved.
template <class T, class Mode, class Shape>
VI_HOT quick_landing<T> quick_flight(const Mode& m, trajectory<T, Shape>& at,
                                     const real_t<T>& horizon) {
    quick_landing<T> end;
    end.duration = T(0.0);
    end.landed = end.moved = false;
    while (may_go_on(m.flow, value(end.duration), horizon)) {
        quick_round<T, Mode, Shape> round(m, at, end);
        round.look(true);
        round.each_stage([&](const auto& stage) VI_WITHIN { stage(round); });
        vec<T, Shape::max_dimension> y;
        round.land(y);
        at.y = y;
        if (!end.moved) break;
        for (int i = 0; i < m.flow.contacts(); ++i)
            at.touching[i] = real_t<T>(0.0);
    }
    return end;
}

} // namespace vi
