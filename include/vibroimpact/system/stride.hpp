// Strides: stretches of a flight without blocks in one application, no contact being within reach.
//
// Method      z is the mechanical part of y, without the forcing lines w: z' = A z + F w + f. In a norm
//             in which the motion without forcing grows by exp(mu t) at most (hybrid.py: its energy),
//             and as derivatives z, z', z'' are motions of the same kind,
//               |z^(m)(t)| <= (1 + 2 mu t) (|z^(m)(0)| + t sum omega^m |F| + [m = 0] t |f|)     (1)
//             while mu t <= 1. What has died out in z^(m)(0) counts no more, whatever its rate. With
//             u^(k) = rows[i] . y^(k-i), each of i = 0..k gives
//               |u^(k)| <= |rows[i]| |z^(k-i)| + what the lines and gains add                 (2)
//             by the dual norm of the row. All is clear for a time t if the gap g keeps
//               g(0) > t max|u'|,   or   g(0) and g(t) > t^2/8 max|u''|                        (3)
//             beyond rounding. The longest such stride of 2^n steps is taken.
//             Watches of elements are guards as contacts are; what is not searched is left out.
// Assumes     a norm and its growth, infinite where none is known; |w| = 1
// Accuracy    |z^(m)| includes what rounding may hide of it; the other terms a margin of 2^-30
// Fails       no stride: the step is marched
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/system/guard.hpp"
#include "vibroimpact/system/refreshed_march.hpp"

namespace vi {

inline constexpr int stride_orders = 3; // z, z', z''
inline constexpr int most_waiting = 15; // steps that are marched until a stride is tried again

// Numbers of one row and its derivatives: dual norms, and what |w| and the constant add at most.
template <class R>
struct row_size {
    R mechanical[stride_orders], line[stride_orders], gain[stride_orders];
};

// Sizes of the rows of a mode, and of what forces add to the motion.
template <class R, class Flow>
struct stride_view {
    row_size<R> rows[Flow::max_contacts + Flow::shape_type::max_watches];
    R push[stride_orders]; // of (1), per unit of time
};

// Guard of a mode by its number: those of contacts first, then the watches of elements.
template <class Mode>
VI_HD inline const auto& guard_of(const Mode& m, int number) {
    if constexpr (Mode::flow_type::shape_type::max_watches > 0)
        if (number >= m.flow.contacts()) return m.watched.at[number - m.flow.contacts()].row;
    return m.guards[number];
}
template <class Mode>
inline constexpr int most_guards =
    Mode::flow_type::max_contacts + Mode::flow_type::shape_type::max_watches;
template <class Mode>
VI_HD inline int guards_of(const Mode& m) {
    return m.flow.contacts() + m.watched.count;
}

namespace detail {

// N^T h = g, |h|: the dual norm of the mechanical part of a row. N is upper triangular but for its order.
template <class Flow, class R, int D>
VI_HD inline R dual_norm(const Flow& flow, const vec<R, D>& row) {
    const int n = flow.dimension() - 2 * flow.lines();
    vec<R, D> h{};
    R square = R(0.0);
    for (int first = 0; first < 2; ++first)
        for (int i = first; i < n; i += 2) {
            if (flow.norm[i][i] == 0.0) continue; // not used in this mode
            R rest = row[i];
            for (int j = first; j < i; j += 2)
                rest = rest - flow.norm[j][i] * h[j];
            h[i] = rest / flow.norm[i][i];
            square = square + h[i] * h[i];
        }
    return sqrt(square);
}

template <class Flow, int D>
VI_HD inline double size_in(const Flow& flow, const vec<double, D>& z) {
    const int n = flow.dimension() - 2 * flow.lines();
    double square = 0.0;
    for (int i = 0; i < n; ++i) {
        const double part = dot(flow.norm[i], z, n);
        square = square + part * part;
    }
    return sqrt(square);
}

// Frequency of a line, whose pair begins at `at`.
template <class Flow>
VI_HD inline double rate_of_line(const Flow& flow, int at) {
    return abs(flow.b[at][at + 1]);
}

} // namespace detail

template <class Mode, class View>
VI_HD inline void prepare_strides(View& to, const Mode& m) {
    const auto& flow = m.flow;
    const int n = flow.dimension(), first = n - 2 * flow.lines();
    for (int i = 0; i < guards_of(m); ++i)
        for (int k = 0; k < stride_orders; ++k) {
            const auto& row = guard_of(m, i).rows[k];
            auto& size = to.rows[i];
            size.mechanical[k] = detail::dual_norm(flow, row);
            size.gain[k] = abs(guard_of(m, i).gains[k]);
            size.line[k] = 0.0;
            for (int at = first; at < n; ++at)
                size.line[k] = size.line[k] + abs(row[at]);
        }
    for (int k = 0; k < stride_orders; ++k)
        to.push[k] = 0.0;
    vec<double, Mode::dimension_limit> column{};
    for (int i = 0; i < first; ++i)
        column[i] = flow.constant[i];
    to.push[0] = detail::size_in(flow, column);
    for (int at = first; at < n; ++at) {
        for (int i = 0; i < first; ++i)
            column[i] = flow.b[i][at];
        double size = detail::size_in(flow, column);
        for (int k = 0; k < stride_orders; ++k) {
            to.push[k] = to.push[k] + size;
            size = size * detail::rate_of_line(flow, at - (at - first) % 2);
        }
    }
}

namespace detail {

// (1) and (2) from one state on.
template <class Mode>
class pace {
public:
    VI_HD pace(const Mode& m, const vec<double, Mode::dimension_limit>& y) : m_(m) {
        const auto& flow = m.flow;
        const int n = flow.dimension(), first = n - 2 * flow.lines();
        auto z = y, terms = y;
        for (int i = 0; i < n; ++i)
            terms[i] = abs(y[i]);
        for (int k = 0; k < stride_orders; ++k) {
            size_[k] = size_in(flow, z) + (k > 0 ? 0x1p-48 * terms_in(terms) : 0.0);
            auto next = z, more = z;
            for (int i = 0; i < n; ++i) {
                next[i] = dot(flow.b[i], z, n, k == 0 ? flow.constant[i] : 0.0);
                more[i] = k == 0 ? abs(flow.constant[i]) : 0.0;
                for (int j = 0; j < n; ++j)
                    more[i] = more[i] + abs(flow.b[i][j]) * terms[j];
            }
            z = next;
            terms = more;
        }
        for (int l = 0; l < flow.lines(); ++l)
            fastest_ = max(fastest_, rate_of_line(flow, first + 2 * l));
    }
    // |u^(order)| of guard i for a time t.
    VI_HD double most(int i, int order, double t) const {
        const auto& rows = m_.view.rows[i];
        double least = infinity();
        for (int k = 0; k <= order; ++k) {
            double lines = rows.line[k];
            for (int j = k; j < order; ++j)
                lines = lines * fastest_;
            const double gain = k == order ? rows.gain[k] : 0.0;
            least = min(least, rows.mechanical[k] * size(order - k, t) + (lines + gain));
        }
        return (1.0 + proof_margin) * least;
    }
    VI_HD bool may_last(double t) const { return m_.flow.growth * t <= 1.0; }

private:
    VI_HD double size(int k, double t) const {
        return (1.0 + 2.0 * m_.flow.growth * t) * (size_[k] + t * m_.view.push[k]);
    }
    VI_HD double terms_in(const vec<double, Mode::dimension_limit>& terms) const {
        const auto& flow = m_.flow;
        const int n = flow.dimension() - 2 * flow.lines();
        double sum = 0.0;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                sum = sum + abs(flow.norm[i][j]) * terms[j];
        return sum;
    }

    const Mode& m_;
    double size_[stride_orders], fastest_ = 0.0;
};

// Distance of a contact from its limits, less rounding after so many applications.
template <class Guard, class Flow, int D>
VI_HD inline double room_of(const Guard& g, const Flow& flow, const vec<double, D>& y,
                            double applications) {
    const double u = guard_value(g, 0, y, flow.dimension());
    const double terms = magnitude(g, 0, y, flow) + g.reach;
    return min(g.upper - u, u - g.lower) - rounding_after(applications, terms);
}

} // namespace detail

// Stride, if one is clear; `applications` are those before the march began, and skips(i) says that guard i is not
// searched. A flight that is next to a stop waits longer and longer before it tries one again.
template <class Mode, class March, class Skips>
VI_HD inline bool stride(const Mode& m, double horizon, double applications, const Skips& skips,
                         March& at) {
    using vector = vec<double, Mode::dimension_limit>;
    const auto& flow = m.flow;
    const int n = flow.dimension(), guards = guards_of(m);
    const vector y = values_of(at.y, n);
    const detail::pace<Mode> now(m, y);
    const auto room = [&](const vector& z, int i) {
        return skips(i) ? infinity()
                        : detail::room_of(guard_of(m, i), flow, z,
                                          applications + at.applications() + 1.0);
    };
    vec<double, most_guards<Mode>> rooms{};
    for (int i = 0; i < guards; ++i)
        rooms[i] = room(y, i);
    const auto length = [&](int k) { return two_to(k) * flow.step; };
    const auto within = [&](int k) {
        return k < Mode::flow_type::doublings && now.may_last(length(k)) &&
               (at.steps() + two_to(k) + 1.0) * flow.step < horizon;
    };
    const auto keeps = [&](int k, int order, const auto& rooms_there) { // (3)
        const double t = length(k);
        for (int i = 0; i < guards; ++i) {
            const double way = now.most(i, order, t) * (order == 1 ? t : t * t / 8.0);
            if (!(rooms_there[i] > way)) return false;
        }
        return true;
    };
    int slow = -1;
    while (within(slow + 1) && keeps(slow + 1, 1, rooms))
        ++slow;
    int bent = slow;
    while (within(bent + 1) && keeps(bent + 1, 2, rooms))
        ++bent;
    for (; bent > slow; --bent) {
        const auto there = flow.apply(flow.power(bent), at.y);
        vec<double, most_guards<Mode>> then{};
        for (int i = 0; i < guards; ++i)
            then[i] = room(values_of(there, n), i);
        if (!keeps(bent, 2, then)) continue;
        at.stride(there, two_to(bent));
        return true;
    }
    if (slow < 0) return false;
    at.stride(flow.apply(flow.power(slow), at.y), two_to(slow));
    return true;
}

} // namespace vi
