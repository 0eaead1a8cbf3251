// Tables that every lane reads at a place of its own.
#pragma once

#include "vibroimpact/math.hpp"
#include "vibroimpact/shape.hpp"

namespace vi {

// A small whole number per lane.
template <int Lanes>
struct place {
    int of[Lanes];
};
template <class R>
using place_t = place<scalar_traits<R>::lanes>;

template <int Lanes>
VI_HD inline place<Lanes> operator+(place<Lanes> p, int shift) {
    for (int& i : p.of)
        i = i + shift;
    return p;
}

// The whole number nearest to x, from 0 to `last`; 0 for NaN (max(0, NaN) is 0).
template <class R>
VI_HOT place_t<R> nearest_place(const R& x, int last) {
    place_t<R> p;
    for (int i = 0; i < scalar_traits<R>::lanes; ++i) {
        const double one = plain(lane(x, i));
        const double above = min(max(0.0, one), double(last)) + 0.5;
        p.of[i] = static_cast<int>(above);
    }
    return p;
}

template <class R>
VI_HOT R as_real(const place_t<R>& p) {
    R x = R(0.0);
    for (int i = 0; i < scalar_traits<R>::lanes; ++i)
        set_lane(x, i, lane_t<R>(static_cast<double>(p.of[i])));
    return x;
}

// Lane i of the result is lane i of what `entry` says of the place of lane i.
template <class R, class Entry>
VI_HOT constexpr R gather(const place_t<R>& p, const Entry& entry) {
    if constexpr (scalar_traits<R>::lanes == 1) {
        return entry(p.of[0]);
    } else {
        R x = R(0.0);
        for (int i = 0; i < scalar_traits<R>::lanes; ++i)
            set_lane(x, i, lane(entry(p.of[i]), i));
        return x;
    }
}

template <class R, int N>
VI_HOT R pick(const vec<R, N>& x, const place_t<R>& p) {
    return gather<R>(p, [&](int i) -> const R& { return x[i]; });
}

} // namespace vi
