// Time at rest on a stop, and how often chatter was completed and a stop grazed.
#pragma once

#include "vibroimpact/observe/observer.hpp"

namespace vi::observe {

struct shares {
    static constexpr const char* name = "shares";
    result_table rest{};   // share of time
    result_table counts{}; // completed chatter, grazes

    void tables(const batch_sizes&, const auto& to) {
        to("rest", rest, 1);
        to("counts", counts, 2, 0.0);
    }

    template <class Flow>
    struct observer {
        double at_rest = 0.0; // time with at least one contact closed
        long chatters = 0, grazes = 0;

        VI_HD void on_flight(const flight_segment<Flow>& s) {
            if (!s.system.is_open(s.mode)) at_rest = at_rest + s.duration;
        }
        VI_HD void on_event(const event_view<Flow>& s) {
            chatters += s.e.what == status::chatter;
            grazes += s.e.what == status::grazing;
        }
        VI_HD void write(const auto& m, const shares& to) const {
            to.rest.put(m.row, at_rest / m.duration);
            to.counts.put(m.row, chatters, grazes);
        }
    };
};

} // namespace vi::observe
