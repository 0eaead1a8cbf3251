// Every observer there is: to add one, include its header and name it at the end of the list.
//
// From this list come the bits that say which are wanted, what a member carries and shows (observers.hpp),
// its rows of results (ensemble/), and the table that Python reads.
#pragma once

#include "vibroimpact/observe/dashpots.hpp"
#include "vibroimpact/observe/dissipation.hpp"
#include "vibroimpact/observe/extremes.hpp"
#include "vibroimpact/observe/final.hpp"
#include "vibroimpact/observe/forces.hpp"
#include "vibroimpact/observe/harmonic.hpp"
#include "vibroimpact/observe/impacts.hpp"
#include "vibroimpact/observe/impulse.hpp"
#include "vibroimpact/observe/lyapunov.hpp"
#include "vibroimpact/observe/power.hpp"
#include "vibroimpact/observe/progress.hpp"
#include "vibroimpact/observe/rms.hpp"
#include "vibroimpact/observe/rotation.hpp"
#include "vibroimpact/observe/section.hpp"
#include "vibroimpact/observe/settling.hpp"
#include "vibroimpact/observe/shares.hpp"
#include "vibroimpact/observe/spectrum.hpp"
#include "vibroimpact/observe/speeds.hpp"
#include "vibroimpact/observe/states.hpp"
#include "vibroimpact/observe/stroboscopic.hpp"
#include "vibroimpact/observe/symbol.hpp"

namespace vi {

template <class... Declared>
struct observer_list {};

using all_observers =
    observer_list<observe::section, observe::symbol, observe::impacts, observe::speeds,
                  observe::power, observe::extremes, observe::rms, observe::lyapunov,
                  observe::spectrum, observe::shares, observe::settling, observe::final_state,
                  observe::rotation, observe::stroboscopic, observe::states, observe::dissipation,
                  observe::forces, observe::impulse, observe::progress, observe::dashpots,
                  observe::harmonic>;

} // namespace vi
