// Tables that every lane reads at a place of its own.
//
// Method      A scalar owns its table. A lane of a pack points to the table of its scalar system;
//             numbers are read from it in pairs or fours, and those of lanes are zipped to packs: three
//             instructions per pack of four instead of seven.
#pragma once

#include "vibroimpact/numeric/sizes.hpp"

namespace vi {

// One entry per lane.
template <int Lanes, class Entry>
struct table_rows {
    const Entry* of[Lanes];
};

// Places are whole numbers, one per lane.
template <class R, class Entry, int Places>
struct table { // of a pack
    const Entry* entry[scalar_traits<R>::lanes];
    VI_HOT auto at(const R& place) const { return rows_at(entry, place); }
};
template <class Entry, int Places>
struct table<double, Entry, Places> {
    alignas(16) Entry entry[Places]; // no pair lies across two lines of the cache
    template <class S>
    VI_HOT constexpr table_rows<1, Entry> at(const S& place) const {
        return {{entry + static_cast<int>(plain(place))}};
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

// The first four numbers.
template <class Entry>
VI_HOT constexpr void pick_four(const table_rows<1, Entry>& rows, two<double>& a, two<double>& b) {
    a = pick_two(rows, 0);
    b = pick_two(rows, 2);
}

} // namespace vi
