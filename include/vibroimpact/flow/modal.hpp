// Flow of a mechanism in independent second-order blocks.
//
// Method      y = (q_1, q_1', q_2, q_2', ...), each block q'' = -k q - c q' + a; the last blocks
//             are the forcing lines, q = sin(theta), q' = omega cos(theta), k = omega^2.
//             With classical damping blocks are vibration modes, and positions of the mechanism show
//             their q alone. Where the flow is mixed, positions are sums of r q + s q', and impulses
//             move q, too.
//             Between events the flow is linear, so marching at a fixed step needs the 2x2
//             propagators of that step only, and no elementary function.
//             Within a step, with S and I of block.hpp by series.hpp,
//               q(s)  = q0 + S(s) q0' + I(s) (a - k q0)                                (1)
//               q'(s) = (1 - k I(s)) q0' + S(s) (a - k q0 - c q0')                    (2)
// Accuracy    one step adds at most 4 ulp of a block's amplitude (four products, two sums)
// Reference   theory.md, "Flight"
#pragma once

#include "vibroimpact/flow/block.hpp"
#include "vibroimpact/flow/series.hpp"

namespace vi {

// Steps after which the refreshed march (system/refreshed_march.hpp) takes the state anew by one long step.
inline constexpr int refresh_interval = 32;
// The quick flight scans two grids of so many times: a wide one, and a narrow one for one of its
// intervals. From one of them, or next to it, it goes on with a stored propagator:
// there are so many per step.
inline constexpr int parts_of_step = 8;
inline constexpr int grid_times = 5;
inline constexpr int grids = 2, wide_grid = 0, narrow_grid = 1;
// Spacings of the wide one, in parts: a lively motion is bounded too loosely with the
// wider. Four times of the narrow one span an interval of the wide one.
inline constexpr int wider_spacing = 12, lively_spacing = 8, narrower = 4;
inline constexpr int places = wider_spacing * grid_times + 1;
// Terms of the Taylor expansion from a stored propagator on, over less than `nearby` of a step:
// (7/10 nearby)^9 / 9! < 2^-56.
inline constexpr int nearby_order = 8;
inline constexpr double nearby = 5.0 / 64;

template <class R, class Shape>
struct modal_flow : sizes<Shape> {
    using shape_type = Shape;
    static constexpr int max_dimension = Shape::max_dimension;
    static constexpr int max_contacts = Shape::max_contacts;
    static constexpr int max_blocks = Shape::max_dimension / 2;
    static constexpr bool several_may_cross = false; // within an interval, for a quick flight
    template <class T>
    using state = vec<T, max_dimension>;

    using real = R;
    using propagator = block_steps<R, max_blocks>;
    // C and S of every block, of lines first, then I a of every block: the rest of exp(B t) follows.
    template <class S>
    using essence = vec<S, 3 * max_blocks + max_blocks % 2>;
    using stored = essence<lane_t<R>>;

    vec<R, max_blocks> k, c, a;
    R step;                         // a short number, so that n * step is exact for n < 2^29
    propagator once;                // exp(B step)
    propagator refresh[2];          // exp(B refresh_interval step), exp(B refresh_interval^2 step)
    table<R, stored, places> ahead; // exp(B j step / parts_of_step)
    bool pushed = false;            // whether any a, of any lane, is or was not zero
    bool bends[max_blocks] = {};    // whether any k, c or a of that block is or was
    R spacing[grids];               // of the times of a grid, in parts of a step
    R grid_error[grids];            // 5/96 h^4, h the same in units of time
    R scan_length;                  // how far the wide grid goes
    vec<R, max_blocks> growth;      // c^2 + c sqrt(k) + k, (3) of search/grid/recall_period.hpp
    block_series<R> series[max_blocks]; // of oscillators, s in units of time
    R per_unit;                         // 1 / unit_of_time(step)

    template <class T>
    VI_HOT constexpr state<T> apply(const propagator& e, const state<T>& y) const {
        state<T> out;
        for (int j = 0; j < this->blocks(); ++j) {
            const T q = y[2 * j], v = y[2 * j + 1];
            const block_step<R>& b = e.block[j];
            out[2 * j] = fma(b.qq, q, fma(b.qv, v, b.qs));
            out[2 * j + 1] = fma(b.vq, q, fma(b.vv, v, b.vs));
        }
        return out;
    }

    // exp(B j step / parts_of_step) y, each lane at its own place j.
    template <class T>
    VI_HOT constexpr state<T> apply_ahead(const real_t<T>& place, const state<T>& y) const {
        const auto rows = ahead.at(place);
        const auto time = place * part();
        two<R> line{}, first{}; // of the line and the first oscillator, which are neighbours
        const bool both = this->lines() == 1 && this->oscillators() > 0 && !drifts<T>(0);
        if (both) pick_four(rows, line, first);
        return apply_by(
            [&](auto j) VI_WITHIN -> numbers {
                if (both && j == 0) return {first.first, first.second, push_of(rows, j)};
                if (both && j == this->oscillators()) return {line.first, line.second, R(0.0)};
                return read(rows, j);
            },
            time, y);
    }
    // exp(B time) y, from what is stored of it: number i is row(i).
    template <class T, class Row>
    VI_HOT constexpr state<T> apply_stored(const Row& row, const real_t<T>& time,
                                           const state<T>& y) const {
        return apply_by(
            [&](auto j) VI_WITHIN -> numbers {
                const int at = stored_at(j);
                return {row(at), row(at + 1), row(this->dimension() + j)};
            },
            time, y);
    }
    // Picks the stored numbers at a place.
    VI_HOT constexpr essence<R> pick(const R& place) const {
        const auto rows = ahead.at(place);
        essence<R> out;
        for (int j = 0; j < this->blocks(); ++j)
            put(out, j, read(rows, j));
        return out;
    }

    // Stored numbers of exp(B (t + s)) from those of exp(B t); Order as in short_flight.
    template <int Order>
    VI_HOT constexpr essence<R> later(const essence<R>& e, const R& s) const {
        essence<R> out;
        const R square = s * s, units = s * per_unit, units_squared = units * units;
        this->each_oscillator([&](auto j) VI_WITHIN {
            const auto sums = series[j].template sums<Order>(units, units_squared);
            const R velocity = s * sums.first, position = square * sums.second; // S, I
            const R full = fnma(k[j], position, R(1.0));
            const auto [c0, s0, i0] = read(e, j);
            put(out, j,
                {fnma(k[j] * velocity, s0, full * c0), fma(velocity, fnma(c[j], s0, c0), full * s0),
                 fma(full, i0, a[j] * fma(velocity, s0, position))});
        });
        this->each_line([&](auto j) VI_WITHIN {
            const auto wave = waves<Order, R>(k[j] * square);
            const R sine = s * wave.second;
            const auto [c0, s0, i0] = read(e, j);
            put(out, j,
                {fnma(k[j] * sine, s0, wave.first * c0), fma(sine, c0, wave.first * s0), i0});
        });
        return out;
    }

    // y' = B y + b.
    template <class T>
    VI_HD constexpr state<T> derivative(const state<T>& y) const {
        state<T> out = y;
        for (int j = 0; j < this->blocks(); ++j) {
            out[2 * j] = y[2 * j + 1];
            out[2 * j + 1] = fnma(c[j], y[2 * j + 1], fnma(k[j], y[2 * j], a[j]));
        }
        return out;
    }

    // exp(B s) y for |s| <= step, by (1) and (2).
    template <int Order, class T, class Time>
    VI_HOT constexpr state<T> short_flight(const state<T>& y, const Time& s) const {
        state<T> out;
        const Time square = s * s, units = s * per_unit, units_squared = units * units;
        this->each_oscillator([&](auto j) VI_WITHIN {
            const T q = y[2 * j], v = y[2 * j + 1];
            if (drifts<T>(j)) {
                out[2 * j] = fma(v, s, q);
                out[2 * j + 1] = v;
                return;
            }
            const auto sums = series[j].template sums<Order>(units, units_squared);
            const Time velocity = s * sums.first, position = square * sums.second; // S, I
            const T still = fnma(k[j], q, a[j]);
            out[2 * j] = fma(v, velocity, fma(still, position, q));
            out[2 * j + 1] = fma(fnma(c[j], v, still), velocity, v * fnma(k[j], position, R(1.0)));
        });
        this->each_line([&](auto j) {
            const auto wave = waves<Order, R>(k[j] * square);
            const Time sine = s * wave.second;
            out[2 * j] = fma(wave.first, y[2 * j], sine * y[2 * j + 1]);
            out[2 * j + 1] = fnma(sine, k[j] * y[2 * j], wave.first * y[2 * j + 1]);
        });
        return out;
    }

    // Flow to second order, for the smallest s.
    template <class T, class Time>
    VI_HOT constexpr state<T> nudge(const state<T>& y, const Time& s) const {
        state<T> out;
        const auto move = [&](auto j, const T& rate, const T& jerk) VI_WITHIN { // jerk reversed
            const T q = y[2 * j], v = y[2 * j + 1];
            out[2 * j] = fma(s, fma(0.5 * s, rate, v), q);
            out[2 * j + 1] = fma(s, fnma(0.5 * s, jerk, rate), v);
        };
        this->each_oscillator([&](auto j) VI_WITHIN {
            if (drifts<T>(j)) {
                out[2 * j] = fma(s, y[2 * j + 1], y[2 * j]);
                out[2 * j + 1] = y[2 * j + 1];
                return;
            }
            const T rate = pull(j, y[2 * j], y[2 * j + 1]);
            move(j, rate, fma(c[j], rate, k[j] * y[2 * j + 1]));
        });
        this->each_line([&](auto j)
                            VI_WITHIN { move(j, -(k[j] * y[2 * j]), k[j] * y[2 * j + 1]); });
        return out;
    }

    // exp(B t) y for any t >= 0.
    template <class T>
    VI_HD state<T> flight(const state<T>& y, double t) const
        requires is_same<R, double>
    {
        return apply(at_time(t), y);
    }
    // exp(B t), by halving t until a block is within the range of sincos, 700 000 rad, and squaring: each
    // square doubles the error, so slow blocks beside fast ones have as few as they need.
    VI_HD propagator at_time(double t) const
        requires is_same<R, double>
    {
        propagator e{};
        for (int j = 0; j < this->blocks(); ++j) {
            const double root = sqrt(k[j]);
            double part = t;
            int halvings = 0;
            for (; part > 0x1p20 * step && root * part > 0x1p19; ++halvings)
                part = part / 2.0;
            e.block[j] = propagate(k[j], c[j], a[j], part);
            for (; halvings > 0; --halvings)
                e.block[j] = after(e.block[j], e.block[j]);
        }
        return e;
    }

    VI_HD void prepare()
        requires is_same<R, double>
    {
        refresh[0] = at_time(refresh_interval * step);
        refresh[1] = at_time(refresh_interval * refresh_interval * step);
        set_spacing(wider_spacing);
        const double unit = unit_of_time(step);
        per_unit = 1.0 / unit;
        pushed = false;
        for (int j = 0; j < this->blocks(); ++j) {
            pushed = pushed || a[j] != 0.0;
            bends[j] = (bits(k[j]) | bits(c[j]) | bits(a[j])) != 0;
            growth[j] = k[j] + c[j] * (c[j] + sqrt(k[j]));
            tabulate(j);
            if (j < this->oscillators()) series[j].expand(k[j] * unit * unit, c[j] * unit);
        }
    }
    VI_HD void set_spacing(int parts)
        requires is_same<R, double>
    {
        spacing[wide_grid] = parts;
        spacing[narrow_grid] = parts / narrower;
        for (int i = 0; i < grids; ++i) {
            const double square = grid_step(i) * grid_step(i);
            grid_error[i] = 5.0 / 96 * (square * square);
        }
        scan_length = grid_times * grid_step(wide_grid);
    }
    // Times of the table are so far apart, those of a grid so far.
    VI_HOT constexpr R part() const { return step * (1.0 / parts_of_step); }
    VI_HD constexpr double grid_step(int grid) const
        requires is_same<R, double>
    {
        return part() * spacing[grid];
    }
    // Whether block j moves straight on in every lane: what is left out for it then are products with
    // zeros and ones, where states are finite and no derivatives are carried. What is left has the same
    // bits, for a zero in a state is -0 by underflow only: the sums that it comes from begin with +0.
    template <class T>
    VI_HOT constexpr bool drifts(int j) const {
        return !scalar_traits<T>::is_jet && !bends[j];
    }
    // q'' of an oscillator.
    template <class T>
    VI_HOT constexpr T pull(int j, const T& q, const T& v) const {
        return fnma(c[j], v, fnma(k[j], q, a[j]));
    }
    // The stored propagator at a place of the table.
    VI_HD propagator whole(int place) const
        requires is_same<R, double>
    {
        propagator e{};
        const auto& from = ahead.entry[place];
        for (int j = 0; j < this->blocks(); ++j) {
            const R full = from[stored_at(j)], s = from[stored_at(j) + 1],
                    i = from[this->dimension() + j];
            e.block[j] = {full, s, i, -(k[j] * s), fnma(c[j], s, full), s * a[j]};
        }
        return e;
    }

    // row -> row B: the next time derivative of a row, and the constant it gains.
    VI_HD constexpr vec<R, max_dimension> next_row(const vec<R, max_dimension>& r) const {
        vec<R, max_dimension> out = r;
        for (int j = 0; j < this->blocks(); ++j) {
            out[2 * j] = -(k[j] * r[2 * j + 1]);
            out[2 * j + 1] = r[2 * j] - c[j] * r[2 * j + 1];
        }
        return out;
    }
    // row -> row e: what the row sees of the state that e leads to, and the constant it gains.
    VI_HD constexpr vec<R, max_dimension> row_before(const propagator& e,
                                                     const vec<R, max_dimension>& r) const {
        vec<R, max_dimension> out = r;
        for (int j = 0; j < this->blocks(); ++j) {
            out[2 * j] = r[2 * j] * e.block[j].qq + r[2 * j + 1] * e.block[j].vq;
            out[2 * j + 1] = r[2 * j] * e.block[j].qv + r[2 * j + 1] * e.block[j].vv;
        }
        return out;
    }
    VI_HD constexpr R gain_before(const propagator& e, const vec<R, max_dimension>& r) const {
        R sum = R(0.0);
        for (int j = 0; j < this->blocks(); ++j)
            sum = sum + (r[2 * j] * e.block[j].qs + r[2 * j + 1] * e.block[j].vs);
        return sum;
    }
    VI_HD constexpr R row_gain(const vec<R, max_dimension>& r) const {
        R sum = R(0.0);
        for (int j = 0; j < this->blocks(); ++j)
            sum = sum + r[2 * j + 1] * a[j];
        return sum;
    }

private:
    // Place of C and S of block j.
    VI_HOT constexpr int stored_at(int j) const {
        return 2 * (j < this->oscillators() ? j + this->lines() : j - this->oscillators());
    }

    // C, S and I a of a block.
    struct numbers {
        R full, velocity, push;
    };
    template <class Rows>
    VI_HOT constexpr numbers read(const Rows& rows, int j) const { // of the table
        const auto [full, velocity] = pick_two(rows, stored_at(j));
        return {full, velocity, push_of(rows, j)};
    }
    template <class Rows>
    VI_HOT constexpr R push_of(const Rows& rows, int j) const {
        const bool still = !pushed || j >= this->oscillators();
        return still ? R(0.0) : pick_two(rows, this->dimension() + j - j % 2).at(j % 2);
    }
    VI_HOT constexpr numbers read(const essence<R>& e, int j) const {
        return {e[stored_at(j)], e[stored_at(j) + 1], e[this->dimension() + j]};
    }
    VI_HOT constexpr void put(essence<R>& to, int j, const numbers& of) const {
        to[stored_at(j)] = of.full;
        to[stored_at(j) + 1] = of.velocity;
        to[this->dimension() + j] = of.push;
    }

    template <class T, class Read>
    VI_HOT constexpr state<T> apply_by(const Read& numbers_of, const real_t<T>& time,
                                       const state<T>& y) const {
        state<T> out;
        this->each_oscillator([&](auto j) VI_WITHIN {
            const T q = y[2 * j], v = y[2 * j + 1];
            if (drifts<T>(j)) {
                out[2 * j] = q + time * v;
                out[2 * j + 1] = v;
                return;
            }
            const numbers e = numbers_of(j);
            out[2 * j] = fma(e.full, q, fma(e.velocity, v, e.push));
            out[2 * j + 1] = fma(e.velocity, pull(j, q, v), e.full * v);
        });
        this->each_line([&](auto j) VI_WITHIN {
            const numbers e = numbers_of(j);
            out[2 * j] = fma(e.full, y[2 * j], e.velocity * y[2 * j + 1]);
            out[2 * j + 1] = fnma(e.velocity, k[j] * y[2 * j], e.full * y[2 * j + 1]);
        });
        return out;
    }

    // Stores the steps of a block.
    VI_HD void tabulate(int j) {
        block_step<double> parts[parts_of_step + 1];
        propagate_in_parts(k[j], c[j], a[j], step / parts_of_step, parts);
        once.block[j] = parts[parts_of_step];
        for (int i = 0; i < places; i += parts_of_step) {
            const auto whole = i <= parts_of_step
                                   ? parts[i]
                                   : propagate(k[j], c[j], a[j], i * (step / parts_of_step));
            for (int p = 0; p < parts_of_step && i + p < places; ++p) {
                const auto e = after(whole, parts[p]);
                put(ahead.entry[i + p], j, {e.qq, e.qv, e.qs});
            }
        }
    }
};

template <class Flow>
inline constexpr bool is_modal = requires(const Flow& f) { f.k; };

} // namespace vi
