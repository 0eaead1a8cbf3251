// Final state: that of the motion at the end of its run, complete or not.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct final_state {
    static constexpr const char* name = "final";
    static constexpr bool of_any_end = true;
    result_table position{}, velocity{}, phase{};

    void tables(const batch_sizes& n, const auto& to) {
        to("position", position, n.degrees);
        to("velocity", velocity, n.degrees);
        to("phase", phase, 1);
    }
    template <class Flow>
    struct observer {
        VI_HD void write(const auto& m, const final_state& to) const {
            m.write_state(m.at.mode, m.at.y, to.position.row(m.row), to.velocity.row(m.row),
                          to.phase.row(m.row));
        }
    };
};

} // namespace vi::observe
