// Coordinates of every mode, as the bindings keep them.
#pragma once

#include <utility>

#include "engine/system.hpp"
#include "vibroimpact/system/mode_coordinates.hpp"

namespace binding {

// Numbers of one mode as add_mode got them; row-major, see coordinates.py.
struct physical_map {
    numbers to_x, to_v, offset, from_x, from_v, particular, shift;
};

class physical_maps {
public:
    physical_maps(int n, int degrees, numbers kappas)
        : n_(n), degrees_(degrees), kappas_(std::move(kappas)) {}

    void add(physical_map map) { maps_.push_back(std::move(map)); }

    vi::mode_coordinates operator[](int mode) const {
        const auto& m = maps_[static_cast<std::size_t>(mode)];
        return {m.to_x.data(),
                m.to_v.data(),
                m.offset.data(),
                m.from_x.data(),
                m.from_v.data(),
                m.particular.data(),
                kappas_.data(),
                degrees_,
                static_cast<int>(kappas_.size()),
                m.shift.empty() ? nullptr : m.shift.data()};
    }

    // x, then v.
    template <int D>
    void append(numbers& out, int mode, const vi::vec<double, D>& y) const {
        const auto p = (*this)[mode];
        for (int i = 0; i < degrees_; ++i)
            out.push_back(vi::position_of(p, i, y, n_));
        for (int i = 0; i < degrees_; ++i)
            out.push_back(vi::velocity_of(p, i, y, n_));
    }

private:
    int n_, degrees_;
    numbers kappas_;
    std::vector<physical_map> maps_;
};

} // namespace binding
