// All observers of a member; a bit mask says which are wanted.
//
// One function, compiled once, serves every combination; an observer that is not wanted costs a
// test of its bit per event in the window.
#pragma once

#include "vibroimpact/observe/averages.hpp"
#include "vibroimpact/observe/extremes.hpp"
#include "vibroimpact/observe/impacts.hpp"
#include "vibroimpact/observe/power.hpp"
#include "vibroimpact/observe/rotation.hpp"
#include "vibroimpact/observe/section.hpp"
#include "vibroimpact/observe/settling.hpp"
#include "vibroimpact/observe/shares.hpp"
#include "vibroimpact/observe/speeds.hpp"
#include "vibroimpact/observe/stroboscopic.hpp"
#include "vibroimpact/observe/symbol.hpp"

namespace vi {

enum observer_bit : unsigned {
    sees_section = 1u << 0,
    sees_symbol = 1u << 1,
    sees_impacts = 1u << 2,
    sees_speeds = 1u << 3,
    sees_power = 1u << 4,
    sees_settling = 1u << 5,
    sees_extremes = 1u << 6,
    sees_averages = 1u << 7,
    sees_shares = 1u << 8,
    sees_rotation = 1u << 9,
    sees_stroboscopic = 1u << 10,
};
inline constexpr unsigned sees_flights =
    sees_extremes | sees_averages | sees_shares | sees_stroboscopic;

template <class Flow>
struct observers {
    using Shape = typename Flow::shape_type;
    unsigned wanted = 0;
    double settle = 0.0; // events before this time are not shown
    bool (*interrupted)() = nullptr;

    vi::section<Shape> section{};
    vi::symbol<Shape> symbol{};
    impact_counts impacts{};
    impact_speeds speeds{};
    impact_energy power{};
    last_impacts<Shape> settling{};
    vi::extremes<Flow> extremes{};
    vi::averages<Flow> averages{};
    vi::shares shares{};
    vi::rotation rotation{};
    vi::stroboscopic<Shape> stroboscopic{};

    trajectory<double, Shape> before{}; // the trajectory before the event, where flights are seen

    VI_HD bool wants(unsigned bits) const { return (wanted & bits) != 0; }

    // Those that are wanted, anew. The others keep what they hold: nobody reads it.
    VI_HD void begin(unsigned bits) {
        wanted = bits;
        renew(section, sees_section);
        renew(symbol, sees_symbol);
        renew(impacts, sees_impacts);
        renew(speeds, sees_speeds);
        renew(power, sees_power);
        renew(settling, sees_settling);
        renew(extremes, sees_extremes);
        renew(averages, sees_averages);
        renew(shares, sees_shares);
        renew(rotation, sees_rotation);
        renew(stroboscopic, sees_stroboscopic);
    }

    // Say where the motion starts.
    VI_HD void depart(const trajectory<double, Shape>& from) {
        if (wants(sees_flights)) before = from;
    }

    // To be called after every event, settling included.
    VI_HD void see(const hybrid<Flow>& system, const event<double, Shape>& e,
                   const trajectory<double, Shape>& at, const clock& now) {
        const double time = now.time();
        if (time >= settle) {
            if (wants(sees_flights))
                see(flown(system, before, e.duration, settle - (time - e.duration), time,
                          interrupted));
            see(scene<Flow>{system, e, at, time});
        }
        depart(at);
    }

private:
    template <class Observer>
    VI_HD void renew(Observer& observer, unsigned bit) {
        if (wants(bit)) observer = Observer{};
    }
    VI_HD void see(const stretch<Flow>& s) {
        if (wants(sees_extremes)) extremes.see(s);
        if (wants(sees_averages)) averages.see(s);
        if (wants(sees_stroboscopic)) stroboscopic.see(s);
        if (wants(sees_shares)) shares.see(s);
    }
    VI_HD void see(const scene<Flow>& s) {
        if (wants(sees_section)) section.see(s);
        if (wants(sees_symbol)) symbol.see(s);
        if (wants(sees_impacts)) impacts.see(s);
        if (wants(sees_speeds)) speeds.see(s);
        if (wants(sees_power)) power.see(s);
        if (wants(sees_settling)) settling.see(s);
        if (wants(sees_shares)) shares.see(s);
        if (wants(sees_rotation)) rotation.see(s);
    }
};

} // namespace vi
