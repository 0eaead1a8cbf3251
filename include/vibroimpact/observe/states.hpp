// Share of time that every element is in each of its states.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct states {
    static constexpr const char* name = "states";
    result_table shares{}; // every state of the first element, then of the next

    void tables(const batch_sizes& n, const auto& to) { to("shares", shares, n.elements * radix); }

    template <class Flow>
    struct observer {
        static constexpr int most = Flow::shape_type::max_elements;
        double time[most > 0 ? most * radix : 1] = {};

        VI_HD void on_flight(const flight_segment<Flow>& s) {
            if constexpr (most > 0) {
                int code = s.system.codes[s.mode] / s.system.closed_sets();
                for (int e = 0; e < s.system.elements.count; ++e, code = code / radix) {
                    double& sum = time[e * radix + code % radix];
                    sum = sum + s.duration;
                }
            }
        }
        VI_HD void write(const auto& m, const states& to) const {
            double* row = to.shares.row(m.row);
            for (long long i = 0; i < to.shares.width; ++i)
                row[i] = time[i] / m.duration;
        }
    };
};

} // namespace vi::observe
