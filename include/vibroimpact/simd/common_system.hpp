// The numbers of one system, for all packs whose lanes have it.
//
// Method      A pack holds the systems of its lanes. Where all of these are one, as in a basin, several
//             packs read it here instead: the nearest cache, which has no room for the numbers of all
//             packs, holds these once.
// Accuracy    the same numbers, so the same bits
#pragma once

#include "vibroimpact/simd/lanes.hpp"

namespace vi {

// Which system each lane has; another version, another system.
template <int N, class Flow>
struct lane_keys {
    const hybrid<Flow>* system[N] = {};
    long version[N] = {};

    // False if lane i has it already.
    bool put(int i, const hybrid<Flow>& another, long number) {
        if (system[i] == &another && version[i] == number) return false;
        system[i] = &another;
        version[i] = number;
        return true;
    }
    bool all_are(const hybrid<Flow>* one, long number) const {
        for (int i = 0; i < N; ++i)
            if (system[i] != one || version[i] != number) return false;
        return true;
    }
};

template <int N, class Flow>
class common_system {
    using numbers_type = lane_systems<N, typename Flow::shape_type>;

public:
    // Where a pack is to read: here, until it leaves; its own numbers if its lanes have several systems,
    // or where other packs read another one here.
    const numbers_type* enter(const lane_keys<N, Flow>& keys, const numbers_type& own) {
        if (!keys.all_are(keys.system[0], keys.version[0])) return &own;
        if (readers_ == 0) {
            numbers_ = own;
            system_ = keys.system[0];
            version_ = keys.version[0];
        }
        if (!keys.all_are(system_, version_)) return &own;
        ++readers_;
        return &numbers_;
    }
    void leave() { --readers_; }

private:
    numbers_type numbers_{};
    const hybrid<Flow>* system_ = nullptr;
    long version_ = 0;
    int readers_ = 0;
};

} // namespace vi
