// Tables that every lane reads at a place of its own.
//
// Method      A scalar owns its table. A lane of a pack points to the table of its scalar system;
//             numbers are read from it in pairs, and pairs of lanes are zipped to packs: three
//             instructions per pack of four instead of seven.
#pragma once

#include "vibroimpact/shape.hpp"

namespace vi {

// A small whole number per lane.
template <int Lanes>
struct place {
    int of[Lanes];
};
template <class R>
using place_t = place<scalar_traits<R>::lanes>;

// Of a real that is a whole number >= 0.
template <class R>
VI_HOT place_t<R> place_of(const R& x) {
    place_t<R> p;
    for (int i = 0; i < scalar_traits<R>::lanes; ++i)
        p.of[i] = static_cast<int>(plain(lane(x, i)));
    return p;
}

// One entry per lane.
template <int Lanes, class Entry>
struct table_rows {
    const Entry* of[Lanes];
};

template <class R, class Entry, int Places>
struct table { // of a pack
    const Entry* entry[scalar_traits<R>::lanes];
    VI_HOT constexpr table_rows<scalar_traits<R>::lanes, Entry> at(const place_t<R>& p) const {
        table_rows<scalar_traits<R>::lanes, Entry> rows;
        for (int i = 0; i < scalar_traits<R>::lanes; ++i)
            rows.of[i] = entry[i] + p.of[i];
        return rows;
    }
};
template <class Entry, int Places>
struct table<double, Entry, Places> {
    Entry entry[Places];
    VI_HOT constexpr table_rows<1, Entry> at(const place<1>& p) const {
        return {{entry + p.of[0]}};
    }
};

// Numbers at, at + 1 of the entry of every lane.
template <class R>
struct two {
    R first, second;
    VI_HOT constexpr const R& at(int i) const { return i == 0 ? first : second; }
};
template <class Entry>
VI_HOT constexpr two<double> pick_two(const table_rows<1, Entry>& rows, int at) {
    return {rows.of[0]->x[at], rows.of[0]->x[at + 1]};
}

} // namespace vi
