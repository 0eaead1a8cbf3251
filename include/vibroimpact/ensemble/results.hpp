// What the observers of one member saw, written as rows of numbers.
#pragma once

#include "vibroimpact/ensemble/build.hpp"
#include "vibroimpact/ensemble/ensemble.hpp"

namespace vi {

template <class Flow>
class member_rows {
    using Shape = typename Flow::shape_type;
    static constexpr int D = Flow::max_dimension;

public:
    VI_HD member_rows(const batch_arrays& b, long long i)
        : b_(b), i_(i), s_(b.system[i]), n_(b.degrees) {}

    // Of a member that has not run: numbers NaN, whole numbers 0.
    VI_CALL void clear() const {
        b_.end[i_] = static_cast<signed char>(member_end::interrupted);
        b_.time[i_] = 0.0;
        fill(b_.section_position, b_.last * n_, not_a_number());
        fill(b_.section_velocity, b_.last * n_, not_a_number());
        fill(b_.section_phase, b_.last, not_a_number());
        fill(b_.section_time, b_.last, not_a_number());
        fill(b_.strobe_position, b_.strobe_last * n_, not_a_number());
        fill(b_.strobe_velocity, b_.strobe_last * n_, not_a_number());
        fill(b_.strobe_phase, b_.strobe_last, not_a_number());
        fill(b_.strobe_time, b_.strobe_last, not_a_number());
        fill(b_.symbol, 1 + 2 * b_.contacts, 0.0);
        fill(b_.impacts, 2, not_a_number());
        fill(b_.speeds, 4, not_a_number());
        fill(b_.power, 1, not_a_number());
        fill(b_.settling, 1, not_a_number());
        fill(b_.shares, 1, not_a_number());
        fill(b_.lyapunov, 1, not_a_number());
        fill(b_.extremes, 2 * b_.extremes_count, not_a_number());
        fill(b_.averages, 2 * b_.averages_count, not_a_number());
        fill(b_.counts, 2, 0.0);
        fill(b_.rotation, 2, not_a_number());
        fill(b_.spectrum, b_.exponents, not_a_number());
        fill(b_.final_position, n_, not_a_number());
        fill(b_.final_velocity, n_, not_a_number());
        fill(b_.final_phase, 1, not_a_number());
    }

    // `period` of the forcing, a unit of time without; `observed`: how long.
    VI_CALL void write(const observers<Flow>& all, double period, double observed) const {
        const double duration = observed > 0.0 ? observed : not_a_number();
        if (all.wants(sees_section))
            write(all.section, {b_.section_position, b_.section_velocity, b_.section_phase,
                                b_.section_time, b_.last});
        if (all.wants(sees_stroboscopic))
            write(all.stroboscopic, {b_.strobe_position, b_.strobe_velocity, b_.strobe_phase,
                                     b_.strobe_time, b_.strobe_last});
        if (all.wants(sees_symbol)) write(all.symbol.result());
        if (all.wants(sees_impacts)) {
            const double periods = duration / period;
            put(b_.impacts, all.impacts.upper / periods, all.impacts.lower / periods);
        }
        if (all.wants(sees_speeds) && all.speeds.count > 0) {
            const auto count = static_cast<double>(all.speeds.count);
            put(b_.speeds, all.speeds.sum / count, sqrt(all.speeds.squares / count),
                all.speeds.smallest, all.speeds.largest);
        }
        if (all.wants(sees_power)) put(b_.power, all.power.lost / duration);
        if (all.wants(sees_extremes)) write(all.extremes);
        if (all.wants(sees_averages)) write(all.averages, duration);
        if (all.wants(sees_shares)) {
            put(b_.shares, all.shares.at_rest / duration);
            put(b_.counts, all.shares.chatters, all.shares.grazes);
        }
        if (all.wants(sees_rotation)) put(b_.rotation, all.rotation.value(), all.rotation.error());
    }

    template <int W>
    VI_HD void write(const growth<W>& tangents) const {
        if (b_.lyapunov) put(b_.lyapunov, tangents.exponent(0));
        for (long long k = 0; b_.spectrum && k < b_.exponents; ++k)
            b_.spectrum[i_ * b_.exponents + k] = tangents.exponent(static_cast<int>(k));
    }

    VI_HD void write_final(const trajectory<double, Shape>& at) const {
        if (b_.final_phase)
            state(at.mode, at.y, b_.final_position + i_ * n_, b_.final_velocity + i_ * n_,
                  b_.final_phase + i_);
    }

private:
    // Fill the row of this member, where there is one.
    VI_HD void fill(double* table, long long width, double value) const {
        for (long long k = 0; table && k < width; ++k)
            table[i_ * width + k] = value;
    }

    template <class... Numbers>
    VI_HD void put(double* table, const Numbers&... numbers) const {
        double* to = table + i_ * static_cast<long long>(sizeof...(numbers));
        ((*to++ = static_cast<double>(numbers)), ...);
    }

    VI_CALL void state(int mode, const vec<double, D>& y, double* x, double* v,
                       double* phase) const {
        const auto p = coordinates_of(b_, mode, s_);
        const int n = sizes_of<Shape>(b_).dimension();
        for (int i = 0; i < p.degrees; ++i) {
            x[i] = position_of(p, i, y, n);
            v[i] = velocity_of(p, i, y, n);
        }
        *phase = p.lines > 0 ? phase_of(p, 0, y, n) : 0.0;
    }

    // Tables of the points of a section, with room for so many.
    struct point_tables {
        double *position, *velocity, *phase, *time;
        long long room;
    };
    template <class Section>
    VI_HD void write(const Section& seen, const point_tables& to) const {
        for (long j = 0; j < seen.kept(); ++j) {
            const auto& point = seen[j];
            const long long at = i_ * to.room + j;
            state(point.mode, point.y, to.position + at * n_, to.velocity + at * n_, to.phase + at);
            to.time[at] = point.time;
        }
    }
    VI_HD void write(const periodic_symbol<Shape::max_contacts>& symbol) const { // n, all p, all q
        const long long contacts = b_.contacts;
        double* to = b_.symbol + i_ * (1 + 2 * contacts);
        to[0] = symbol.n;
        for (long long c = 0; c < contacts; ++c) {
            to[1 + c] = symbol.p[c];
            to[1 + contacts + c] = symbol.q[c];
        }
    }
    VI_HD void write(const vi::extremes<Flow>& e) const {
        for (int k = 0; k < e.watched.count; ++k) {
            double* to = b_.extremes + 2 * (i_ * e.watched.count + k);
            const bool seen = e.of[k].low <= e.of[k].high;
            to[0] = seen ? e.of[k].low : not_a_number();
            to[1] = seen ? e.of[k].high : not_a_number();
        }
    }
    VI_HD void write(const vi::averages<Flow>& a, double duration) const {
        for (int k = 0; k < a.watched.count; ++k) {
            double* to = b_.averages + 2 * (i_ * a.watched.count + k);
            to[0] = a.of[k].first / duration;
            to[1] = sqrt(a.of[k].second / duration);
        }
    }

    const batch_arrays& b_;
    long long i_, s_, n_;
};

} // namespace vi
