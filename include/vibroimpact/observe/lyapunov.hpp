// The largest Lyapunov exponent, of the tangent vector that a member carries (growth.hpp).
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct lyapunov {
    static constexpr const char* name = "lyapunov";
    result_table exponent{};

    void tables(const batch_sizes&, const auto& to) { to("exponent", exponent, 1); }
    static long long tangents(const batch_sizes&) { return 1; }
    template <class Flow>
    struct observer {
        VI_HD void write(const auto& m, const lyapunov& to) const {
            to.exponent.put(m.row, m.exponents[0]);
        }
    };
};

} // namespace vi::observe
