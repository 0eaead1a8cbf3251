// Whether a motion is silent: no guard that is searched in its mode will ever end the flight.
//
// Method      A modal flow: every contact stays clear for an infinite time (search/reach.hpp).
//             Another: of the coordinates that guards see, directly or by way of others, those whose
//             derivatives are zero exactly, and depend on nothing that moves, stand still. The others, z,
//             have z' = A z + F w + f, w the lines. With E = exp(A t) so small after a time t that was
//             found by doubling, and exp(B t) = (E, G; 0, R) on (z, w),
//               z = P w + p + h,   P = G R^-1,   p = what f and what stands still add in t       (1)
//             where h' = A h + d, d what (1) leaves of its equation by rounding. In the norm
//             max |h_i| / s_i, s balancing rows and columns of A,
//               |h| <= 2 S (|h(0)| + S t |d|),   S = exp(|A| step) product max(1, |exp(A step 2^k)|)  (2)
//             for ever. In the norm N of strides (system/stride.hpp), with e = 1 + 2 mu t, mu t <= 1,
//               |h| <= e (|h(0)| + 3 e t |d|)                                                       (3)
//             where |E| is below 1/2 in this one. So u = r . y + g stays within r P w, of known amplitude, and |r| s |h| of r p + g.
//             A guard that sees nothing that moves may also lie on its limit: it stays there.
// Assumes     has not diverged; no guard is due at this instant
// Accuracy    margin 2^-30 of the terms with blocks; without, their rounding beside that in d
// Fails       false: not proved. Free and undamped masses are not, in flows without blocks
// Reference   theory.md, "First contact"
#pragma once

#include "vibroimpact/search/reach.hpp"

namespace vi {

namespace detail {

inline constexpr double faded = 0x1p-40; // |E|, whose square is below rounding

template <class Guard>
VI_HD inline bool is_between(const Guard& g, double low, double high, double margin) {
    return (g.lower == -infinity() || low - margin > g.lower) &&
           (g.upper == infinity() || high + margin < g.upper);
}

// Whether u, which does not change, lies within its limits, or on one.
template <class Guard>
VI_HD inline bool stays_within(const Guard& g, double u, double terms) {
    return (u > g.lower && u < g.upper) || side_within(g, u, terms) != 0.0;
}

// Whether a contact sees only blocks of a modal flow that are at rest exactly.
template <class Guard, class Flow, int D>
VI_HD inline bool sees_rest(const Guard& g, const Flow& flow, const vec<double, D>& y) {
    for (int j = 0; j < flow.blocks(); ++j) {
        const bool seen = g.rows[0][2 * j] != 0.0 || g.rows[0][2 * j + 1] != 0.0;
        const double v = y[2 * j + 1];
        if (seen && (v != 0.0 || flow.a[j] - flow.k[j] * y[2 * j] != 0.0)) return false;
    }
    return true;
}

template <class Mode, int D>
VI_HD inline bool all_silent(const Mode& m, const vec<double, D>& y) {
    for (int i = 0; i < m.flow.contacts(); ++i) {
        const auto& g = m.guards[i];
        const bool rests =
            sees_rest(g, m.flow, y) &&
            stays_within(g, guard_value(g, 0, y, m.flow.dimension()), magnitude(g, 0, y, m.flow));
        if (!rests && !stays_clear(g, m.flow, y, infinity())) return false;
    }
    return true;
}

// A flow without blocks from the state y on: (1) and (2).
template <class Mode>
class lasting {
    static constexpr int D = Mode::dimension_limit;

public:
    template <class Searched>
    VI_HD lasting(const Mode& m, const vec<double, D>& y, const Searched& searched)
        : m_(m), y_(y), n_(m.flow.dimension()), first_(n_ - 2 * m.flow.lines()) {
        see(searched);
        set_still();
        balance();
    }
    // Whether the motion is known for ever.
    VI_HD bool settles() {
        const auto& flow = m_.flow;
        auto p = flow.doubled[0];
        const auto size = [&] { return size_of([&](int i, int j) { return p.entry(i, j); }); };
        const double rate = size_of([&](int i, int j) { return flow.b[i][j]; });
        double time = flow.step, swell = exponential(rate * flow.step);
        for (int k = 0; size() > faded; ++k) {
            swell = swell * max(1.0, size());
            if (k == Mode::flow_type::doublings) return false;
            p = flow.after(p, p);
            time = time + time;
        }
        p = flow.after(p, p);
        time = time + time;
        set_response(p);
        vec<double, D> h{}, d{};
        double left = 0.0, defect = 0.0;
        for (int i = 0; i < first_; ++i) {
            if (!moves_[i]) continue;
            h[i] = y_[i] - rest_[i];
            for (int j = first_; j < n_; ++j)
                h[i] = h[i] - answer_[i][j] * y_[j];
            d[i] = defect_of(i);
            left = max(left, abs(h[i]) / size_[i]);
            defect = max(defect, d[i] / size_[i]);
        }
        off_ = 2.0 * swell * (left + swell * time * defect);
        const double grown = 1.0 + 2.0 * flow.growth * time;
        if (flow.growth * time <= 1.0 && size() * spread() <= 0.5)
            energy_ = grown * (size_in(flow, h) + 3.0 * grown * time * largest_in(d));
        return min(off_, energy_) < infinity();
    }
    template <class Guard>
    VI_HD bool is_clear(const Guard& g) const {
        const auto& row = g.rows[0];
        double mean = g.gains[0], terms = abs(g.gains[0]) + g.reach, amplitude = 0.0, off = 0.0;
        for (int i = 0; i < first_; ++i) {
            const double share = row[i] * (moves_[i] ? rest_[i] : seen_[i] ? y_[i] : 0.0);
            mean = mean + share;
            terms = terms + abs(share);
            if (moves_[i]) off = off + abs(row[i]) * size_[i];
        }
        off = off == 0.0 ? 0.0 : min(off * off_, share_in_energy(row));
        for (int at = first_; at < n_; at += 2) {
            double sine = row[at], cosine = row[at + 1], sizes = abs(sine) + abs(cosine);
            for (int i = 0; i < first_; ++i) {
                if (!moves_[i]) continue;
                sine = sine + row[i] * answer_[i][at];
                cosine = cosine + row[i] * answer_[i][at + 1];
                sizes = sizes + abs(row[i] * answer_[i][at]) + abs(row[i] * answer_[i][at + 1]);
            }
            const double size = sqrt(y_[at] * y_[at] + y_[at + 1] * y_[at + 1]);
            amplitude = amplitude + size * sqrt(sine * sine + cosine * cosine);
            terms = terms + sizes;
        }
        if (off == 0.0 && amplitude == 0.0) return stays_within(g, mean, terms);
        const double most = amplitude + off;
        return is_between(g, mean - most, mean + most, rounding_at(g.reach, terms + most));
    }

private:
    template <class Searched>
    VI_HD void see(const Searched& searched) {
        for (int k = 0; k < guards_of(m_); ++k)
            for (int i = 0; searched(k) && i < first_; ++i)
                seen_[i] = seen_[i] || guard_of(m_, k).rows[0][i] != 0.0;
        for (int pass = 0; pass < first_; ++pass)
            for (int i = 0; i < first_; ++i)
                for (int j = 0; seen_[i] && j < first_; ++j)
                    seen_[j] = seen_[j] || m_.flow.b[i][j] != 0.0;
    }
    VI_HD void set_still() {
        for (int pass = 0; pass < first_; ++pass)
            for (int i = 0; i < first_; ++i) {
                const auto& row = m_.flow.b[i];
                bool moves = seen_[i] && dot(row, y_, n_, m_.flow.constant[i]) != 0.0;
                for (int j = 0; seen_[i] && j < n_; ++j)
                    moves = moves || (row[j] != 0.0 && (j >= first_ || moves_[j]));
                moves_[i] = moves_[i] || moves;
            }
    }
    VI_HD void balance() {
        constexpr int sweeps = 8;
        for (int i = 0; i < first_; ++i)
            size_[i] = 1.0;
        for (int sweep = 0; sweep < sweeps; ++sweep)
            for (int i = 0; i < first_; ++i) {
                double row = 0.0, column = 0.0;
                for (int j = 0; j < first_; ++j) {
                    if (j == i || !moves_[i] || !moves_[j]) continue;
                    row = row + abs(m_.flow.b[i][j]) * size_[j];
                    column = column + abs(m_.flow.b[j][i]) / size_[j];
                }
                if (row > 0.0 && column > 0.0) size_[i] = sqrt(row / column);
            }
    }
    template <class Entry>
    VI_HD double size_of(const Entry& entry) const {
        double largest = 0.0;
        for (int i = 0; i < first_; ++i) {
            double sum = 0.0;
            for (int j = 0; moves_[i] && j < first_; ++j)
                if (moves_[j]) sum = sum + abs(entry(i, j)) * size_[j];
            largest = max(largest, sum / size_[i]);
        }
        return largest;
    }
    // What a row sees of a motion of which (3) holds.
    VI_HD double share_in_energy(const vec<double, D>& row) const {
        if (!(energy_ < infinity())) return infinity();
        auto part = row;
        for (int i = 0; i < first_; ++i)
            if (!moves_[i]) part[i] = 0.0;
        return dual_norm(m_.flow, part) * energy_;
    }
    // |z| in the norm of (3), |z_i| <= d_i.
    VI_HD double largest_in(const vec<double, D>& d) const {
        double sum = 0.0;
        for (int i = 0; i < first_; ++i) {
            vec<double, D> one{};
            one[i] = d[i];
            sum = sum + size_in(m_.flow, one);
        }
        return sum;
    }
    // Factor by which a matrix may be larger in the norm of (3) than in that of (2).
    VI_HD double spread() const {
        double back = 0.0;
        vec<double, D> sizes{};
        for (int i = 0; i < first_; ++i) {
            if (!moves_[i]) continue;
            vec<double, D> one{};
            one[i] = 1.0;
            back = max(back, dual_norm(m_.flow, one) / size_[i]);
            sizes[i] = size_[i];
        }
        return back * largest_in(sizes);
    }
    // exp(x) <= 1 / (1 - x / 16)^16, x < 16.
    VI_HD static double exponential(double x) {
        if (!(x < 8.0)) return infinity();
        double out = 1.0 / (1.0 - x / 16.0);
        for (int i = 0; i < 4; ++i)
            out = out * out;
        return out;
    }
    template <class Propagator>
    VI_HD void set_response(const Propagator& p) { // (1)
        for (int i = 0; i < first_; ++i) {
            if (!moves_[i]) continue;
            rest_[i] = p.shift[i];
            for (int j = 0; j < first_; ++j)
                if (seen_[j] && !moves_[j]) rest_[i] = rest_[i] + p.change[i][j] * y_[j];
            for (int at = first_; at < n_; at += 2) {
                const double a = p.entry(at, at), b = p.change[at][at + 1],
                             c = p.change[at + 1][at], d = p.entry(at + 1, at + 1),
                             whole = a * d - b * c;
                const double sine = p.change[i][at], cosine = p.change[i][at + 1];
                answer_[i][at] = (sine * d - cosine * c) / whole;
                answer_[i][at + 1] = (cosine * a - sine * b) / whole;
            }
        }
    }
    // |d| of coordinate i, at most.
    VI_HD double defect_of(int i) const {
        const auto& b = m_.flow.b;
        double still = m_.flow.constant[i], sum = 0.0;
        for (int j = 0; j < first_; ++j)
            if (seen_[j]) still = still + b[i][j] * (moves_[j] ? rest_[j] : y_[j]);
        for (int at = first_; at < n_; at += 2)
            for (int k = at; k < at + 2; ++k) {
                const int other = k == at ? at + 1 : at;
                double off = b[i][k] - answer_[i][other] * b[other][k];
                for (int j = 0; j < first_; ++j)
                    if (moves_[j]) off = off + b[i][j] * answer_[j][k];
                sum = sum + abs(off);
            }
        return abs(still) + sum;
    }

    const Mode& m_;
    const vec<double, D>& y_;
    int n_, first_;
    bool seen_[D] = {}, moves_[D] = {};
    vec<double, D> size_{}, rest_{};
    vec<vec<double, D>, D> answer_{};
    double off_ = 0.0, energy_ = infinity(); // |h| for ever, by (2) and (3)
};

// Whether watch j is on a limit that no derivative leads away from.
template <class Mode, int D, class Start>
VI_HD inline bool keeps_limit(const Mode& m, int j, const vec<double, D>& y, const Start& start) {
    const auto& g = m.watched.at[j].row;
    return start.elements.stays_on(j) && side_within(g, guard_value(g, 0, y, m.flow.dimension()),
                                                     magnitude(g, 0, y, m.flow)) != 0.0;
}

} // namespace detail

// Whether it is proved that nothing is to come in mode m from the state y on, of a flight that began at `start`.
template <class Mode, class T, int D, class Start>
VI_RARE bool is_silent(const Mode& m, const vec<T, D>& y, const Start& start) {
    const vec<double, D> z = detail::plain_state(y, m.flow.dimension());
    if constexpr (is_modal<typename Mode::flow_type>) {
        return detail::all_silent(m, z);
    } else {
        const auto searched = [&](int number) {
            if constexpr (Mode::flow_type::shape_type::max_watches > 0)
                if (const int j = number - m.flow.contacts(); j >= 0)
                    return !m.watched.at[j].held && !detail::keeps_limit(m, j, z, start);
            return true;
        };
        detail::lasting<Mode> motion(m, z, searched);
        if (!motion.settles()) return false;
        for (int k = 0; k < guards_of(m); ++k)
            if (searched(k) && !motion.is_clear(guard_of(m, k))) return false;
        return true;
    }
}

} // namespace vi
