// The scan of grid_bounds.hpp for one trajectory of a large mode, its guards side by side in registers.
//
// Method      As grid_scan, operation for operation for each guard. Which of the guards that cross is first is
//             then asked one by one.
// Accuracy    as grid_bounds.hpp
// Reference   theory.md, "Elements"
#pragma once

#include "vibroimpact/search/grid/grid_bounds.hpp"
#include "vibroimpact/system/large_mode.hpp"

namespace vi {

namespace detail {

struct limit_pack {
    row_pack lower, upper;
};

// u of some guards, from one on, and the size of its terms.
struct guards_now {
    row_pack u, terms;
    template <class Shape, int D>
    VI_HOT guards_now(const large_mode<Shape>& m, int first, const vec<double, D>& y)
        : u(load(m.all.gains + first)), terms(load(m.all.least_terms + first)) {
        const int apart = filled(m.flow.contacts());
        for (int j = 0; j < m.flow.dimension(); ++j) {
            u = fma(load(m.all.rows + j * apart + first), row_pack(y[j]), u);
            terms = fma(load(m.all.weights + j * apart + first), row_pack(abs(y[j])), terms);
        }
    }
};

template <class Shape>
VI_HOT limit_pack limits_of(const large_mode<Shape>& m, int first) {
    return {load(m.all.lower + first), load(m.all.upper + first)};
}

template <class Shape>
class guards_scan {
    static constexpr int K = Shape::max_contacts, D = Shape::max_dimension;
    static constexpr int most = filled(K) / row_lanes;

public:
    scan_result<double> result;

    VI_HOT void scan(const large_mode<Shape>& m, int grid, const vec<double, D>& y,
                     const vec<double, K>& touching) {
        double side[filled(K)] = {};
        for (int i = 0; i < m.flow.contacts(); ++i)
            side[i] = touching[i];
        packs_ = filled(m.flow.contacts()) / row_lanes;
        inside_ = true;
        for (int p = 0; p < packs_; ++p)
            inside_ = look_ahead(m, grid, y, load(side + p * row_lanes), p) && inside_;
        interval_ = 0;
        result.begin = 0.0;
        result.length = m.flow.spacing[grid];
        result.clear = inside_;
        for (int k = 0; result.clear && k < grid_intervals; ++k) {
            interval_ = k;
            for (int p = 0; result.clear && p < packs_; ++p)
                result.clear = all(apart_[p].kept(limits_[p], along_[p].after_time(k)));
            if (result.clear) result.begin = result.begin + result.length;
        }
    }
    VI_HOT void cross(const large_mode<Shape>&) {
        result.found = result.several = false;
        result.stop = {};
        result.place = result.begin;
        if (!inside_ || result.clear) return;
        bool crosses = false, back = false, known = true;
        for (int p = 0; p < packs_; ++p) {
            scan_result<row_pack> s;
            s.begin = row_pack(result.begin);
            s.length = row_pack(result.length);
            const open_interval<row_pack> open{along_[p].after_time(interval_), apart_[p]};
            const auto met = meet(limits_[p], 0, open, s);
            known = known && all(met.clear | met.crosses);
            for (int i = 0; any(met.crosses) && i < row_lanes; ++i) {
                if (!lane(met.crosses, i)) continue;
                result.several = result.several || crosses;
                if (crosses && !(lane(s.place, i) < result.place)) continue;
                crosses = true;
                back = lane(met.back, i);
                result.place = lane(s.place, i);
                result.stop.side = lane(s.stop.side, i);
                result.stop.contact = p * row_lanes + i;
            }
        }
        result.found = crosses && known;
        result.clear = known && !crosses;
        if (result.clear) result.begin = result.begin + result.length;
        result.place = result.found ? nearest_place(result.place) : result.begin;
        if (!(result.found && back)) return;
        result.begin = result.begin + soonest_return;
        result.length = result.length - soonest_return;
    }

private:
    // Some guards along the grid; whether all of them are between their limits now, or on one.
    VI_HOT bool look_ahead(const large_mode<Shape>& m, int grid, const vec<double, D>& y,
                           const row_pack& side, int p) {
        constexpr int times = grid_times + 1;
        const auto& rows = m.all;
        const int first = p * row_lanes, apart = filled(m.flow.contacts());
        row_pack fourth = load(rows.least_fourth + first), u[times];
        unrolled<0, times>(
            [&](auto k) VI_WITHIN { u[k] = load(rows.ahead_gains[grid] + k * apart + first); });
        for (int j = 0; j < m.flow.dimension(); ++j) {
            const row_pack x = y[j];
            const double* ahead = rows.ahead[grid] + j * times * apart + first;
            unrolled<0, times>([&](auto k)
                                   VI_WITHIN { u[k] = fma(load(ahead + k * apart), x, u[k]); });
            fourth = fma(load(rows.fourth + j * apart + first), abs(x), fourth);
        }
        const guards_now now(m, first, y);
        const auto limits = limits_[p] = limits_of(m, first);
        const row_pack margin = proof_margin * now.terms;
        const auto apart_from =
            apart_[p] = {fma(fourth, row_pack(m.flow.grid_error[grid]), margin), margin};
        const auto open = side == 0.0;
        auto& along = along_[p];
        unrolled<0, times>([&](auto k) VI_WITHIN { along.u[k] = u[k]; });
        along.now = select(open, now.u, select(side > 0.0, limits.upper, limits.lower));
        along.before = fma(row_pack(2.0), along.now, u[0] - u[1]);
        return all(!open | apart_from.between(limits, now.u));
    }

    int packs_, interval_;
    bool inside_;
    limit_pack limits_[most];
    distances<row_pack> apart_[most];
    along_grid<row_pack> along_[most];
};

// Whether all contacts but the one that hits are between their limits.
template <class Shape, int D>
VI_RARE bool is_first(const large_mode<Shape>& m, const vec<double, D>& y,
                      const stop_hit<double>& hit) {
    const int number = static_cast<int>(hit.contact);
    for (int first = 0; first < m.flow.contacts(); first += row_lanes) {
        const guards_now now(m, first, y);
        const row_pack margin = proof_margin * now.terms;
        auto inside = distances<row_pack>{margin, margin}.between(limits_of(m, first), now.u);
        if (number >= first && number < first + row_lanes) set_lane(inside, number - first, true);
        if (!all(inside)) return false;
    }
    return true;
}

// The scan of a mode.
template <class Mode, class R, int K>
struct scan_of {
    using type = grid_scan<R, K>;
};
template <class Shape, int K>
struct scan_of<large_mode<Shape>, double, K> {
    using type = guards_scan<Shape>;
};
template <class Mode, class R, int K>
using scan_type = typename scan_of<Mode, R, K>::type;

} // namespace detail

} // namespace vi
