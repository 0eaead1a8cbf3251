// What the observers of one member saw, as rows of numbers.
#pragma once

#include <cmath>
#include <limits>

#include "batch.hpp"
#include "physical_map.hpp"
#include "vibroimpact/ensemble.hpp"

namespace binding {

template <class Flow>
class member_results {
    using Shape = typename Flow::shape_type;
    static constexpr int D = Flow::max_dimension;
    static constexpr double nan = std::numeric_limits<double>::quiet_NaN();

public:
    // `period` of the forcing, NaN without; `duration` that was observed.
    member_results(observed& out, std::size_t i, const physical_maps& physical, int dimension,
                   double period, double duration)
        : out_(out), i_(i), physical_(physical), n_(dimension), period_(period),
          duration_(duration > 0.0 ? duration : nan) {}

    void write(const vi::observers<Flow>& all) const {
        if (all.wants(vi::sees_section)) write(all.section);
        if (all.wants(vi::sees_symbol)) write(all.symbol.result());
        if (all.wants(vi::sees_impacts)) write(all.impacts);
        if (all.wants(vi::sees_speeds)) write(all.speeds);
        if (all.wants(vi::sees_power)) out_.power.row(i_)[0] = all.power.lost / duration_;
        if (all.wants(vi::sees_extremes)) write(all.extremes);
        if (all.wants(vi::sees_averages)) write(all.averages);
        if (all.wants(vi::sees_shares)) write(all.shares);
    }

    template <int W>
    void write(const vi::growth<W>& tangents) const {
        if (out_.lyapunov.width) out_.lyapunov.row(i_)[0] = tangents.exponent(0);
        for (std::size_t k = 0; k < out_.spectrum.width; ++k)
            out_.spectrum.row(i_)[k] = tangents.exponent(static_cast<int>(k));
    }

    void write_final(const vi::trajectory<double, Shape>& at) const {
        if (out_.final_phase.width == 0) return;
        state(at.mode, at.y, out_.final_position.row(i_), out_.final_velocity.row(i_),
              out_.final_phase.row(i_));
    }

private:
    void state(int mode, const vi::vec<double, D>& y, double* x, double* v, double* phase) const {
        const auto p = physical_[mode];
        for (int i = 0; i < p.degrees; ++i) {
            x[i] = vi::position_of(p, i, y, n_);
            v[i] = vi::velocity_of(p, i, y, n_);
        }
        *phase = p.lines > 0 ? vi::phase_of(p, 0, y, n_) : 0.0;
    }

    void write(const vi::section<Shape>& section) const {
        const std::size_t points = out_.section_phase.width;
        const std::size_t degrees = out_.section_position.width / points;
        for (long j = 0; j < section.kept(); ++j) {
            const auto& point = section[j];
            state(point.mode, point.y, out_.section_position.row(i_) + j * degrees,
                  out_.section_velocity.row(i_) + j * degrees, out_.section_phase.row(i_) + j);
            out_.section_time.row(i_)[j] = point.time;
        }
    }
    void write(const vi::periodic_symbol& s) const {
        put(out_.symbol, {double(s.n), double(s.p), double(s.q)});
    }
    void write(const vi::impact_counts& c) const {
        const double periods = duration_ / period_;
        put(out_.impacts, {c.upper / periods, c.lower / periods});
    }
    void write(const vi::impact_speeds& s) const {
        if (s.count == 0) return;
        const auto count = static_cast<double>(s.count);
        put(out_.speeds, {s.sum / count, std::sqrt(s.squares / count), s.smallest, s.largest});
    }
    void write(const vi::extremes<Flow>& e) const {
        double* to = out_.extremes.row(i_);
        for (int k = 0; k < e.watched.count; ++k) {
            const bool seen = e.of[k].low <= e.of[k].high;
            *to++ = seen ? e.of[k].low : nan;
            *to++ = seen ? e.of[k].high : nan;
        }
    }
    void write(const vi::averages<Flow>& a) const {
        double* to = out_.averages.row(i_);
        for (int k = 0; k < a.watched.count; ++k) {
            *to++ = a.of[k].first / duration_;
            *to++ = std::sqrt(a.of[k].second / duration_);
        }
    }
    void write(const vi::shares& s) const {
        put(out_.shares, {s.at_rest / duration_});
        put(out_.counts, {double(s.chatters), double(s.grazes)});
    }

    void put(table& t, std::initializer_list<double> values) const {
        std::copy(values.begin(), values.end(), t.row(i_));
    }

    observed& out_;
    std::size_t i_;
    const physical_maps& physical_;
    int n_;
    double period_, duration_;
};

} // namespace binding
