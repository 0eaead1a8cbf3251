// Answers of a system to Python, for one flow of the kernel.
#pragma once

#include <stdexcept>
#include <string>

#include "engine/compiled_system.hpp"
#include "engine/observers.hpp"

namespace binding {

template <class Flow>
class system_of final : public system, compiled_system<Flow> {
    using compiled = compiled_system<Flow>;
    using compiled::hybrid_, compiled::modes_;
    using compiled::n_, compiled::degrees_, compiled::lines_, compiled::physical_;
    using Shape = typename Flow::shape_type;
    static constexpr int D = Flow::max_dimension;
    static constexpr int width = tangent_width<Flow>;
    using state = vi::vec<double, D>;
    template <class T>
    using trajectory = vi::trajectory<T, Shape>;

public:
    using compiled::compiled_system;

    void add_mode(const mode_data& data) override { compiled::add_mode(data); }

    int add_reset(const numbers& matrix, const numbers& shift) override {
        return compiled::add_reset(matrix, shift);
    }

    start_result start(const start_data& data) const override {
        const auto at = this->template begin<double>(data);
        start_result out;
        out.at = packed(at, vi::clock{});
        for (int i = 0; i < hybrid_.contacts(); ++i) {
            const auto gap = vi::gap_at_start(hybrid_, at, i);
            out.gap_lower.push_back(gap.lower);
            out.gap_upper.push_back(gap.upper);
            out.eps.push_back(gap.rounding);
        }
        return out;
    }

    int settle(position& from) const override {
        auto at = unpacked<double>(from);
        const auto states = vi::settle_elements(hybrid_, at);
        if (states.what == vi::decision::missing) return states.code;
        if (states.what == vi::decision::undecided) return -1;
        from = packed(at, vi::clock{from.high, from.low});
        return 0;
    }

    record simulate(position& from, const limits_data& limit) const override {
        const bool follows = hybrid_.elements.count > 0;
        recorder<Shape> see{physical_, n_, lines_, follows ? from.mode : 0, follows};
        const auto end = go_on(from, limit, see);
        see.out.why = static_cast<int>(end.why);
        see.out.code = end.code;
        return std::move(see.out);
    }

    progress advance(position& from, const limits_data& limit) const override {
        counter see;
        const auto end = go_on(from, limit, see);
        return {static_cast<int>(end.why), end.code, see.events};
    }

    numbers evaluate(const std::vector<int>& mode, const numbers& y, const numbers& dt,
                     bool (*interrupted)()) const override {
        numbers out;
        out.reserve(dt.size() * 2 * degrees_);
        for (std::size_t i = 0; i < dt.size(); ++i) {
            if (i % vi::between_interrupt_checks == 0 && i > 0 && interrupted()) break;
            state at{};
            std::copy_n(y.begin() + static_cast<std::ptrdiff_t>(i) * n_, n_, at.x);
            physical_.append(out, mode[i], modes_[mode[i]].flow.flight(at, dt[i]));
        }
        return out;
    }

    tangent_result tangents(const start_data& data, const numbers& seeds, int count,
                            const limits_data& limit) const override {
        tangent_result out;
        out.columns.assign(static_cast<std::size_t>(2 * degrees_ + lines_) * count, 0.0);
        out.durations.assign(count, 0.0);
        for (int first = 0; first < count; first += width)
            tangent_block(data, seeds, first, count, limit, out);
        return out;
    }

    lyapunov_result lyapunov(const position& from, const limits_data& limit,
                             long block) const override {
        return growth_of<1>(from, limit, block, 1);
    }

    lyapunov_result spectrum(const position& from, const limits_data& limit, long block,
                             int count) const override {
        if (count < 1 || count > width)
            throw std::invalid_argument("count: at most " + std::to_string(width) + ".");
        return growth_of<width>(from, limit, block, count);
    }

    numbers acceleration(const start_data& data) const override {
        const auto rates = modes_[0].flow.derivative(this->template begin<double>(data).y);
        numbers out;
        for (int i = 0; i < degrees_; ++i)
            out.push_back(vi::velocity_of(physical_[0], i, rates, n_));
        return out;
    }

    // Columns: x, v, then the forcing pairs (sin, cos) of the lines: (2n, 2n + 2L), row-major.
    numbers flow_matrix(double dt) const override {
        using jet = vi::jet<double, 1>;
        const int columns = 2 * degrees_ + 2 * lines_;
        const auto free = physical_[0];
        numbers out(static_cast<std::size_t>(2 * degrees_) * columns);
        for (int j = 0; j < columns; ++j) {
            std::vector<jet> p(columns, jet(0.0));
            p[j].d[0] = 1.0;
            const jet *x = p.data(), *v = x + degrees_, *waves = v + degrees_;
            vi::forcing_pairs<jet> pairs{};
            for (int l = 0; l < lines_; ++l) {
                pairs[2 * l] = waves[2 * l];
                pairs[2 * l + 1] = free.kappas[l] * waves[2 * l + 1];
            }
            const auto y = modes_[0].flow.flight(vi::from_physical(free, x, v, pairs, hybrid_), dt);
            for (int i = 0; i < degrees_; ++i) {
                out[static_cast<std::size_t>(i) * columns + j] =
                    vi::position_of(free, i, y, n_).d[0];
                out[static_cast<std::size_t>(degrees_ + i) * columns + j] =
                    vi::velocity_of(free, i, y, n_).d[0];
            }
        }
        return out;
    }

    // (v before) -> (v after) as an (n, n) matrix, row-major.
    numbers impact_matrix(int contact, int side) const override {
        numbers out(static_cast<std::size_t>(degrees_) * degrees_);
        const auto free = physical_[0];
        const auto& law = hybrid_.laws[contact];
        const double restitution = vi::restitution_at(hybrid_, contact, side);
        for (int j = 0; j < degrees_; ++j) {
            state y{};
            for (int i = 0; i < n_; ++i)
                y[i] = free.from_v[i * degrees_ + j];
            const double rate = side * vi::dot(modes_[0].guards[contact].rows[1], y, n_);
            vi::push_away(y, n_, law, static_cast<double>(side),
                          vi::rebound_of(rate, restitution).change * law.effective_mass);
            for (int i = 0; i < degrees_; ++i)
                out[static_cast<std::size_t>(i) * degrees_ + j] = vi::velocity_of(free, i, y, n_);
        }
        return out;
    }

private:
    static vi::limits limits_of(const limits_data& l) {
        return {l.t_max, l.flight_limit, l.events, l.impacts, l.interrupted};
    }

    template <class Observer>
    vi::run_result go_on(position& from, const limits_data& limit, Observer& see) const {
        auto at = unpacked<double>(from);
        vi::clock now{from.high, from.low};
        const auto end = vi::run(hybrid_, at, now, limits_of(limit), see);
        from = packed(at, now);
        return end;
    }

    template <int W>
    lyapunov_result growth_of(const position& from, const limits_data& limit, long block,
                              int count) const {
        auto at = vi::with_tangents<W>(hybrid_, unpacked<double>(from), count);
        vi::clock now{};
        vi::growth<W> tangent;
        tangent.count = count;
        growth_meter<Flow, W> see{block, tangent, {hybrid_, tangent, at}};
        const auto end = vi::run(hybrid_, at, now, limits_of(limit), see);
        see.out.why = static_cast<int>(end.why);
        see.out.code = end.code;
        return std::move(see.out);
    }

    void tangent_block(const start_data& data, const numbers& seeds, int first, int count,
                       const limits_data& limit, tangent_result& out) const {
        using jet = tangents_of<Flow>;
        auto at = this->template begin<jet>(data, seeds, count, first);
        vi::clock now{};
        duration_sum<jet> see;
        const auto end = vi::run(hybrid_, at, now, limits_of(limit), see);
        out.events = see.events;
        out.why = static_cast<int>(end.why);
        out.code = end.code;
        if (end.why == vi::run_end::horizon) end_at_one_time(at, see.duration);
        const auto p = physical_[at.mode];
        const auto put = [&](int row, int j, double x) {
            out.columns[row * count + first + j] = x;
        };
        for (int j = 0; j < std::min(width, count - first); ++j) {
            for (int i = 0; i < degrees_; ++i) {
                put(i, j, vi::position_of(p, i, at.y, n_).d[j]);
                put(degrees_ + i, j, vi::velocity_of(p, i, at.y, n_).d[j]);
            }
            for (int l = 0; l < lines_; ++l) { // dtheta = cos d(sin) - sin d(cos)
                const jet s = vi::sine_of(p, l, at.y, n_), c = vi::cosine_of(p, l, at.y, n_);
                put(2 * degrees_ + l, j, c.v * s.d[j] - s.v * c.d[j]);
            }
            out.durations[first + j] = see.duration.d[j];
        }
    }

    // A flight that ends at the horizon ends a fixed time after the last event: moved to the horizon itself.
    template <class Jet>
    void end_at_one_time(vi::trajectory<Jet, Shape>& at, Jet& duration) const {
        const auto& flow = modes_[at.mode].flow;
        const auto rates = flow.derivative(vi::detail::plain_state(at.y, n_));
        for (int j = 0; j < width; ++j) {
            for (int i = 0; i < n_; ++i)
                at.y[i].d[j] -= rates[i] * duration.d[j];
            duration.d[j] = 0.0;
        }
    }

    position packed(const trajectory<double>& at, const vi::clock& now) const {
        const int contacts = hybrid_.contacts();
        position out{{at.y.x, at.y.x + n_},
                     at.mode,
                     at.held,
                     {at.touching.x, at.touching.x + contacts},
                     {at.rate.x, at.rate.x + contacts},
                     {at.flat.x, at.flat.x + contacts},
                     now.high,
                     now.low};
        if constexpr (Shape::max_elements > 0) {
            out.states = at.elements.code;
            out.settled = at.elements.settled;
            out.due = at.elements.due;
            out.size = at.elements.size;
            out.zeros.assign(at.elements.zeros, at.elements.zeros + Shape::max_watches);
            out.offset.assign(at.elements.offset, at.elements.offset + Shape::max_watches);
        }
        return out;
    }

    template <class T>
    trajectory<T> unpacked(const position& p) const {
        trajectory<T> out{};
        out.mode = p.mode;
        out.held = p.held;
        if constexpr (Shape::max_elements > 0) {
            out.elements.code = p.states;
            out.elements.settled = p.settled;
            out.elements.due = p.due;
            out.elements.size = p.size;
            std::copy(p.zeros.begin(), p.zeros.end(), out.elements.zeros);
            std::copy(p.offset.begin(), p.offset.end(), out.elements.offset);
        }
        std::copy(p.y.begin(), p.y.end(), out.y.x);
        std::copy(p.touching.begin(), p.touching.end(), out.touching.x);
        std::copy(p.rate.begin(), p.rate.end(), out.rate.x);
        std::copy(p.flat.begin(), p.flat.end(), out.flat.x);
        return out;
    }
};

} // namespace binding
