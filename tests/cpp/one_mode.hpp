// A system of one mode and one contact for tests, wired to itself: the flow, the guard and the mobility of
// the contact are left to set. It holds pointers to its own parts, so it must not be copied.
#pragma once

#include "vibroimpact/system/hybrid.hpp"

template <class Flow>
struct one_mode {
    vi::mode<double, Flow> free{};
    vi::coordinate_map<Flow::max_dimension> same{};
    int code = 0;
    vi::hybrid<Flow> hybrid{};

    one_mode() = default;
    one_mode(const one_mode&) = delete;
    one_mode& operator=(const one_mode&) = delete;

    // Once flow and guard are set. The blow on the first coordinate is elastic.
    void wire() {
        vi::prepare_search(free, true);
        static_cast<vi::sizes<typename Flow::shape_type>&>(hybrid) = free.flow;
        for (int i = 0; i < Flow::max_dimension; ++i)
            same.matrix[i][i] = 1.0;
        hybrid.modes = &free;
        hybrid.from_free = hybrid.to_free = &same;
        hybrid.codes = &code;
        hybrid.mode_count = 1;
        auto& law = hybrid.laws[0];
        law.impulse[1] = law.shift[0] = 1.0;
        law.mobility[0] = law.effective_mass = 1.0;
        law.restitution_lower = law.restitution_upper = 1.0;
    }
};
