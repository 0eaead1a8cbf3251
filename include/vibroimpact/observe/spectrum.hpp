// All Lyapunov exponents but that of the flow's direction, of as many tangent vectors (growth.hpp).
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct spectrum {
    static constexpr const char* name = "spectrum";
    result_table exponents{};

    void tables(const batch_sizes& n, const auto& to) { to("exponents", exponents, tangents(n)); }
    static long long tangents(const batch_sizes& n) { return 2 * n.degrees + n.lines - 1; }
    template <class Flow>
    struct observer {
        VI_HD void write(const auto& m, const spectrum& to) const {
            for (long long k = 0; k < to.exponents.width; ++k)
                to.exponents.row(m.row)[k] = m.exponents[k];
        }
    };
};

} // namespace vi::observe
