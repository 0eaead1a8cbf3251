// Many runs of machines with elements, one per lane; in a round all lanes of a pack are in the same mode.
//
// Method      As lane_run.hpp, but a lane has the numbers of every mode of its system, and each round is
//             flown in the mode in which most lanes of the pack are; the others wait. So lanes come to
//             change their modes together. Where a flight ends on a watch, quick_states.hpp decides
//             what follows; whatever it is not sure of, and impacts of rigid stops, are left to the
//             scalar engine, lane by lane.
//             The host is that of lane_run.hpp, and says which modes there may be: code of mode m, or -1.
// Accuracy    bits of run(): the same operations for each trajectory in the same order
// Fails       more than `most_lane_modes` modes: the host has to run members one by one
#pragma once

#include "vibroimpact/simd/lane_run.hpp"
#include "vibroimpact/transition/quick_states.hpp"

namespace vi {

inline constexpr int most_lane_modes = 12;

// The numbers of a mode, of every lane that has them.
template <int N, class Guarded, int Watches>
struct lane_mode {
    using real = pack<N>;
    static constexpr int D = Guarded::max_dimension;
    quick_mode<real, Guarded> quick;
    watch_view<real, D> watches[Watches];
    int watch_count = 0;
    bool constrained = false;
    vec<vec<real, D>, D> project; // entering it, where that is so
    vec<real, D> shift;
    pack_mask<N> has = pack_mask<N>(false), able = pack_mask<N>(false);
};

namespace detail {

template <int N, class Guarded, class From>
inline void fill_quick_flow(quick_flow<pack<N>, Guarded>& to, const From& from, int i) {
    const int n = from.dimension();
    static_cast<sizes<Guarded>&>(to) = {n, from.lines(), from.contacts(), false};
    for (int k = 0; k < longest_powers; ++k)
        for (int r = 0; r < n; ++r) {
            fill_row(to.powers[k].e[r], from.powers[k].e[r], n, i);
            set_lane(to.powers[k].shift[r], i, from.powers[k].shift[r]);
        }
    for (int r = 0; r < n; ++r)
        fill_row(to.b[r], from.b[r], n, i);
    fill_row(to.constant, from.constant, n, i);
    set_lane(to.step, i, from.step);
    for (int g = 0; g < grids; ++g) {
        set_lane(to.spacing[g], i, from.spacing[g]);
        set_lane(to.grid_error[g], i, from.grid_error[g]);
    }
    set_lane(to.scan_length, i, from.scan_length);
}

template <int N, class Guarded, class From>
inline void fill_quick_guard(quick_guard<pack<N>, Guarded>& to, const From& from, int n, int i) {
    for (int m = 0; m <= to.orders; ++m) {
        fill_row(to.rows[m], from.rows[m], n, i);
        set_lane(to.gains[m], i, from.gains[m]);
    }
    for (int grid = 0; grid < grids; ++grid)
        fill_rows(to.ahead[grid], from.ahead[grid], n, i);
    fill_row(to.fourth, from.fourth, n, i);
    fill_row(to.weights, from.weights, n, i);
    set_lane(to.least_fourth, i, from.least_fourth);
    set_lane(to.least_terms, i, from.least_terms);
    set_lane(to.lower, i, from.lower);
    set_lane(to.upper, i, from.upper);
}

template <int N, int D, class Watch>
inline void fill_watch(watch_view<pack<N>, D>& to, const Watch& from, int n, int i) {
    for (int m = 0; m < 2; ++m) {
        fill_row(to.rows[m], from.row.rows[m], n, i);
        set_lane(to.gains[m], i, from.row.gains[m]);
        set_lane(to.sizes[m], i, from.terms[m].per_largest);
        set_lane(to.adds[m], i, from.terms[m].adds);
    }
    set_lane(to.lower, i, from.row.lower);
    set_lane(to.upper, i, from.row.upper);
    to.element = from.element;
    to.held = from.held;
    to.mapped = from.reset >= 0 || from.target >= 0;
}

// Lane i gets the numbers of mode m of a system.
template <int N, class Guarded, int Watches, class Flow>
inline void put_mode(lane_mode<N, Guarded, Watches>& to, int i, const hybrid<Flow>& system, int m) {
    const auto& from = system.modes[m];
    const int n = system.dimension();
    fill_quick_flow(to.quick.flow, from.quick.flow, i);
    for (int g = 0; g < from.quick.flow.contacts(); ++g) {
        fill_quick_guard(to.quick.guards[g], from.quick.guards[g], n, i);
        to.quick.number[g] = from.quick.number[g];
    }
    to.watch_count = from.watched.count;
    for (int j = 0; j < to.watch_count; ++j)
        fill_watch(to.watches[j], from.watched.at[j], n, i);
    to.constrained = from.watched.constrained;
    for (int r = 0; to.constrained && r < n; ++r) {
        fill_row(to.project[r], system.from_free[m].matrix[r], n, i);
        set_lane(to.shift[r], i, system.from_free[m].shift[r]);
    }
    set_lane(to.has, i, true);
    set_lane(to.able, i, from.quick.able);
}

} // namespace detail

template <int N, class Flow, class Guarded, class Host>
class mode_pack : public lane_runs<N, Flow, Host> {
    using runs = lane_runs<N, Flow, Host>;
    using runs::busy_, runs::events_, runs::first_, runs::high_, runs::host_, runs::keys_,
        runs::low_;
    using runs::more_, runs::runs_, runs::shown_from_, runs::slots_, runs::until_, runs::work_;
    using Shape = typename Flow::shape_type;
    using real = pack<N>;
    using mask = pack_mask<N>;
    using state = vec<real, Guarded::max_dimension>;
    using landed_on = quick_landing<real>;
    using scalar = trajectory<double, Shape>;
    using round_type = quick_round<real, quick_mode<real, Guarded>, Guarded>;
    static constexpr int W = Shape::max_watches, E = Shape::max_elements;

public:
    void begin_runs(Host& host, int first, long& work) {
        this->set_host(host, first, work);
        count_ = host.modes();
        for (int m = 0; m < count_; ++m)
            codes_[m] = host.code(m);
        fill();
    }

    // A round, as of lane_pack: it scans where any lane flies.
    VI_HOT void begin() {
        now_ = fullest();
        going_ = in_[now_];
        if (!any(going_)) return round_.rest();
        const auto& mode = modes_[now_].quick;
        round_.use(mode);
        round_.begin(going_ & may_go_on(mode.flow, flown_, until_ - (high_ + low_)));
    }
    VI_HOT bool scans() const { return round_.scans(); }
    VI_HOT auto& round() { return round_; }
    template <class Take>
    VI_HOT static void each_stage(const Take& take) {
        round_type::each_stage(take);
    }
    VI_HOT void end_round() {
        landed_on end;
        state y;
        end.landed = end.moved = mask(false);
        if (scans()) round_.template land<false>(end, y);
        end.landed = end.landed & going_;
        go_on(end.moved & going_, end, y);
        const mask wanted = end.landed & (end.duration > 0.0) & !kept_;
        const mask taken = any(wanted) ? take_states(wanted, end, y) : wanted;
        const mask others = busy_ & !taken & !(end.moved & going_) & (going_ | !quick_);
        if (any(others)) handle(others, end, y);
        if (runs_ < N && more_) fill();
    }

    void interrupt() {
        for (int i = 0; i < N; ++i) {
            if (!lane(busy_, i)) continue;
            suspend(i);
            finish(i, run_end::interrupted);
        }
    }

private:
    // The mode in which most lanes wait for a round.
    VI_HOT int fullest() const {
        int best = 0, most = 0;
        for (int m = 0; m < count_; ++m) {
            int lanes = 0;
            for (int i = 0; i < N; ++i)
                lanes += lane(in_[m], i);
            if (lanes > most) {
                most = lanes;
                best = m;
            }
        }
        return best;
    }

    // Flights of these lanes go on from where all is clear.
    VI_HOT void go_on(const mask& moved, const landed_on& end, const state& y) {
        const auto& flow = modes_[now_].quick.flow;
        flow.each_coordinate([&](auto j) VI_WITHIN { at_.y[j] = select(moved, y[j], at_.y[j]); });
        flow.each_contact(
            [&](auto g) VI_WITHIN { at_.touching[g] = select(moved, real(0.0), at_.touching[g]); });
        flown_ = select(moved, end.duration, flown_);
        applications_ = plus_where(moved, applications_, real(applications_of_round));
        changed_ = changed_ | moved;
    }

    // Flights that ended on a watch: the states that follow. Lanes where these are sure; there, all is done.
    VI_HOT mask take_states(const mask& landed, const landed_on& end, const state& y) {
        const auto& flow = modes_[now_].quick.flow;
        state there;
        flow.each_coordinate([&](auto j) VI_WITHIN { there[j] = y[j]; });
        renormalise_forcing(there, flow.dimension(), flow.lines(), inverse_omega_squared_);
        real largest = size_;
        flow.each_coordinate([&](auto j) VI_WITHIN { largest = max(largest, abs(there[j])); });
        mask taken = mask(false);
        for (int e = 0; e < elements_; ++e) {
            const mask mine = landed & on_watch_of(e, end);
            if (!any(mine)) continue;
            const mask alone = mine & others_inside(e, there, largest);
            if (any(alone)) taken = taken | take_state_of(e, alone, there, largest);
        }
        this->count(taken, end.duration);
        const mask told = taken & ((high_ + low_ >= shown_from_) | (events_ >= most_events_) |
                                   (impacts_ >= most_impacts_));
        if (any(told)) tell(told, end, there);
        return taken;
    }

    VI_HOT mask on_watch_of(int e, const landed_on& end) const {
        const auto& mode = modes_[now_];
        mask out = mask(false);
        for (int g = 0; g < mode.quick.flow.contacts(); ++g) {
            const int j = mode.quick.number[g] - contacts_;
            if (j >= 0 && mode.watches[j].element == e && !mode.watches[j].mapped)
                out = out | (end.stop.contact == static_cast<double>(g));
        }
        return out;
    }

    // Whether no other element is at a limit, and no contact.
    VI_HOT mask others_inside(int e, const state& y, const real& largest) const {
        const auto& mode = modes_[now_];
        const auto& flow = mode.quick.flow;
        mask out = mask(true);
        for (int j = 0; j < mode.watch_count; ++j) {
            if (mode.watches[j].element == e) continue;
            const auto verdict = detail::judge(mode.watches[j], flow, y, largest);
            out = out & verdict.lasts & (verdict.side == 0.0);
        }
        for (int g = 0; g < flow.contacts() && mode.quick.number[g] < contacts_; ++g) {
            out = out & detail::is_inside(mode.quick.guards[g], flow, y);
        }
        return out;
    }

    // The state that follows of one element, all others being inside their limits. Lanes where that is sure.
    VI_HOT mask take_state_of(int e, const mask& lanes, const state& y, const real& largest) {
        mask open = lanes, sure = lanes, by_law = mask(false), takes[radix];
        int next[radix];
        for (int s = radix - 1; s >= 0; --s) {
            takes[s] = mask(false);
            if (!(states_[e] >> s & 1)) continue;
            const int n = next[s] = with_state(e, s);
            if (n < 0) return mask(false);
            const auto& mode = modes_[n];
            mask lasts = mode.has, fails = mask(false);
            for (int j = 0; j < mode.watch_count; ++j) {
                const auto verdict = detail::judge(mode.watches[j], mode.quick.flow, y, largest);
                lasts = lasts & verdict.lasts;
                fails = fails | verdict.fails;
            }
            if (n != now_) takes[s] = open & lasts;
            sure = sure & (takes[s] | by_law | (fails & mode.has));
            open = open & !takes[s];
            if (!soft_[e] && s == detail::sticking_state) by_law = takes[s];
        }
        sure = sure & !open;
        const int was = detail::state_in_code(codes_[now_] / closed_sets_, e);
        for (int s = 0; s < radix && any(sure); ++s) {
            const mask mine = takes[s] & sure;
            if (!any(mine)) continue;
            enter(next[s], mine, y, largest);
            if (soft_[e] && detail::meets_stop(was, s))
                impacts_ = plus_where(mine, impacts_, real(1.0));
        }
        return sure;
    }

    // Mode with another state of an element, or -1.
    VI_HOT int with_state(int e, int s) const {
        const int code = closed_sets_ * detail::with_state(codes_[now_] / closed_sets_, e, s);
        for (int m = 0; m < count_; ++m)
            if (codes_[m] == code) return m;
        return -1;
    }

    VI_HOT void enter(int n, const mask& lanes, const state& y, const real& largest) {
        const auto& mode = modes_[n];
        const auto& flow = mode.quick.flow;
        const int d = flow.dimension();
        real size = real(0.0);
        state there;
        for (int j = 0; j < d; ++j) {
            there[j] = mode.constrained ? dot(mode.project[j], y, d, mode.shift[j]) : y[j];
            size = max(size, abs(there[j]));
        }
        for (int j = 0; j < d; ++j)
            at_.y[j] = select(lanes, there[j], at_.y[j]);
        for (int g = 0; g < flow.contacts(); ++g) {
            const int j = mode.quick.number[g] - contacts_;
            real side = real(0.0);
            if (j >= 0) {
                const auto verdict = detail::judge(mode.watches[j], flow, y, largest);
                side = verdict.side;
                offset_[j] = select(lanes, verdict.offset, offset_[j]);
            }
            at_.touching[g] = select(lanes, side, at_.touching[g]);
            at_.rate[g] = select(lanes, real(1.0), at_.rate[g]);
        }
        size_ = select(lanes, max(size, 0.5 * size_), size_);
        flown_ = select(lanes, real(0.0), flown_);
        applications_ = select(lanes, real(0.0), applications_);
        changed_ = changed_ | lanes;
        in_[now_] = in_[now_] & !lanes;
        in_[n] = in_[n] | (lanes & mode.able);
        quick_ = quick_ & !(lanes & !mode.able);
        for (int i = 0; i < N; ++i)
            if (lane(lanes, i)) mode_[i] = n;
    }

    // ---- lane by lane ----

    // Events that are not simply counted: shown to the host, or at a limit. `before`: where they happened.
    [[gnu::noinline]] void tell(const mask& lanes, const landed_on& end, const state& before) {
        for (int i = 0; i < N; ++i) {
            if (!lane(lanes, i)) continue;
            const auto& mode = modes_[now_];
            const int guard = static_cast<int>(lane(end.stop.contact, i));
            const int element = mode.watches[mode.quick.number[guard] - contacts_].element;
            const int was = detail::state_in_code(codes_[now_] / closed_sets_, element);
            const int is = detail::state_in_code(codes_[mode_[i]] / closed_sets_, element);
            const bool met = soft_[element] && detail::meets_stop(was, is);
            event<double, Shape> e{};
            e.what = met ? status::engage : status::change;
            e.contact = contacts_ + element;
            e.side = met ? detail::side_of_soft(is) : static_cast<int>(lane(end.stop.side, i));
            e.duration = lane(end.duration, i);
            e.rate_before = e.rate_after = -lane(end.stop.side, i) * lane(end.speed, i);
            for (int j = 0; j < slots_[i].system->dimension(); ++j)
                e.before[j] = lane(before[j], i);
            suspend(i);
            inform(i, e);
        }
    }

    void fill() {
        for (int i = 0; i < N && more_; ++i)
            if (!lane(busy_, i)) load(i);
    }

    void load(int i) {
        if (!this->take_run(i)) return;
        const auto& slot = slots_[i];
        const auto& system = *slot.system;
        if (keys_.put(i, system, slot.version)) put_system(i, system);
        set_lane(most_events_, i, static_cast<double>(slot.limit.events));
        set_lane(most_impacts_, i, static_cast<double>(slot.limit.impacts));
        resume(i);
    }

    void put_system(int i, const hybrid<Flow>& system) {
        for (int m = 0; m < count_; ++m)
            set_lane(modes_[m].has, i, false);
        contacts_ = system.contacts();
        closed_sets_ = system.closed_sets();
        elements_ = system.elements.count;
        for (int e = 0; e < elements_; ++e) {
            states_[e] = system.elements.states[e];
            soft_[e] = system.elements.soft[e];
        }
        for (int l = 0; l < system.lines(); ++l)
            set_lane(inverse_omega_squared_[l], i, system.inverse_omega_squared[l]);
    }

    // From the slot into the lane, with the modes that were built since.
    void resume(int i, double flown = 0.0, int applications = 0) {
        const auto& [at, so_far] = *slots_[i].run;
        const auto& system = *slots_[i].system;
        for (int m = 0; m < count_; ++m) {
            if (system.codes[m] == codes_[m] && system.is_open(m) && !lane(modes_[m].has, i))
                detail::put_mode(modes_[m], i, system, m);
            set_lane(in_[m], i, false);
        }
        const auto& quick = system.modes[at.mode].quick;
        const bool able = quick.able && at.held == 0 && at.elements.settled && at.elements.due == 0;
        mode_[i] = at.mode;
        set_lane(quick_, i, able);
        set_lane(changed_, i, false);
        bool kept = false;
        for (int k = 0; k < contacts_; ++k)
            kept = kept || is_kept(system, at, k);
        set_lane(kept_, i, kept);
        if (able) {
            trajectory<double, guarded_of<Shape>> there;
            detail::stand(system.modes[at.mode], at, there);
            for (int g = 0; g < quick.flow.contacts(); ++g) {
                set_lane(at_.touching[g], i, there.touching[g]);
                set_lane(at_.rate[g], i, there.rate[g]);
            }
            for (int j = 0; j < W; ++j)
                set_lane(offset_[j], i, at.elements.offset[j]);
            set_lane(in_[at.mode], i, true);
        }
        for (int j = 0; j < system.dimension(); ++j)
            set_lane(at_.y[j], i, at.y[j]);
        set_lane(size_, i, at.elements.size);
        set_lane(flown_, i, flown);
        set_lane(applications_, i, static_cast<double>(applications));
        set_lane(high_, i, so_far.now.high);
        set_lane(low_, i, so_far.now.low);
        set_lane(events_, i, static_cast<double>(so_far.events));
        set_lane(impacts_, i, static_cast<double>(so_far.impacts));
    }

    // Whether a contact touches its stop while the mode of a motion keeps its gap; the slot says so as long as that lasts.
    static bool is_kept(const hybrid<Flow>& system, const scalar& at, int k) {
        return at.touching[k] != 0.0 && keeps_gap(system.modes[at.mode], k);
    }

    // From the lane into the slot.
    void suspend(int i) {
        auto& [at, so_far] = *slots_[i].run;
        const auto& system = *slots_[i].system;
        const long events = static_cast<long>(lane(events_, i));
        so_far.now = {lane(high_, i), lane(low_, i)};
        if (events != so_far.events) so_far.at_once = 0;
        so_far.events = events;
        so_far.impacts = static_cast<long>(lane(impacts_, i));
        const bool flies = lane(quick_, i) && lane(flown_, i) > 0.0;
        if (!flies && !lane(changed_, i)) return; // stands where the slot says
        for (int j = 0; j < system.dimension(); ++j)
            at.y[j] = lane(at_.y[j], i);
        at.mode = mode_[i];
        at.flat = {};
        at.elements = {codes_[at.mode] / closed_sets_, true, 0, lane(size_, i)};
        const auto& quick = system.modes[at.mode].quick;
        for (int k = 0; k < contacts_; ++k)
            if (!(lane(kept_, i) && is_kept(system, at, k))) at.touching[k] = 0.0;
        for (int g = 0; g < quick.flow.contacts() && !flies; ++g) {
            const int number = quick.number[g], j = number - contacts_;
            const double side = lane(at_.touching[g], i);
            if (j < 0) {
                if (side != 0.0) at.touching[number] = side;
            } else if (side != 0.0) {
                at.elements.zeros[j] = static_cast<int>(side);
                at.elements.offset[j] = lane(offset_[j], i);
            }
        }
    }

    [[gnu::noinline]] void handle(const mask& lanes, const landed_on& end, const state& y) {
        for (int i = 0; i < N; ++i) {
            if (!lane(lanes, i)) continue;
            suspend(i);
            if (lane(end.landed, i))
                land(i, end, y);
            else
                certify(i);
        }
    }

    // A flight that has landed on a guard, by the scalar engine.
    void land(int i, const landed_on& end, const state& y) {
        auto& at = slots_[i].run->at;
        const auto& system = *slots_[i].system;
        const auto& quick = system.modes[at.mode].quick;
        const int side = static_cast<int>(lane(end.stop.side, i));
        const int number = quick.number[static_cast<int>(lane(end.stop.contact, i))];
        landing<double, Shape> there{
            flight_end::contact,        number, side, lane(end.duration, i),
            -side * lane(end.speed, i), at.y};
        for (int j = 0; j < system.dimension(); ++j)
            there.y[j] = lane(y[j], i);
        const scalar start = at;
        auto e = cross_guard(system, at, there);
        if (const int missing = detail::settle_after(system, at, e)) {
            at = start;
            return request_mode(i, missing);
        }
        if (report(i, e)) resume(i);
    }

    // A flight that no round has brought on, by a certified step.
    void certify(int i) {
        const auto& slot = slots_[i];
        auto& [at, so_far] = *slot.run;
        const double flown = lane(flown_, i), left = slot.limit.t_max - so_far.now.time();
        const int earlier = static_cast<int>(lane(applications_, i));
        ++*work_;
        const scalar start = at;
        const auto e = detail::continue_certified(*slot.system, at, flown, earlier, left);
        if (detail::is_unfinished(e.what)) {
            if (e.what == status::searching) *work_ += steps_in_a_row;
            return resume(i, e.duration, e.applications);
        }
        if (e.what == status::missing_mode) {
            at = start;
            return request_mode(i, e.wanted);
        }
        if (report(i, e)) resume(i);
    }

    bool report(int i, const event<double, Shape>& e) {
        vi::count(slots_[i].run->so_far, e);
        return inform(i, e);
    }

    // Sees an event that is counted; false if it is the last.
    bool inform(int i, const event<double, Shape>& e) {
        const run_end why = this->show(i, e);
        if (why != run_end::none) finish(i, why);
        return why == run_end::none;
    }

    // The event did not happen yet: the flight goes on from where it was.
    void request_mode(int i, int code) {
        if (code < 0 || !host_->build(first_ + i, code)) return finish(i, run_end::missing);
        resume(i, lane(flown_, i), static_cast<int>(lane(applications_, i)));
    }

    void finish(int i, run_end why) {
        for (int m = 0; m < count_; ++m)
            set_lane(in_[m], i, false);
        this->return_run(i, why);
    }

    int count_ = 0, codes_[most_lane_modes]; // of modes, built or not
    int contacts_ = 0, closed_sets_ = 1, elements_ = 0, states_[E];
    bool soft_[E];
    lane_mode<N, Guarded, W> modes_[most_lane_modes];
    real inverse_omega_squared_[max_lines];

    // Positions of the lanes; guards count as those of the mode of each.
    trajectory<real, Guarded> at_{};
    real flown_{}, applications_{}, size_{}, offset_[W]{};
    int mode_[N] = {};
    mask in_[most_lane_modes] = {}; // lanes whose flights in this mode may be quick
    mask quick_{}, changed_{};      // whether that is so in any; what the slot does not know of
    mask
        kept_{}; // a stop is touched that the mode keeps: what follows is left to the scalar engine

    int now_ = 0; // the mode of this round, and its lanes
    mask going_;
    flight_memory<quick_flow<real, Guarded>> memory_;
    round_type round_{modes_[0].quick, at_, flown_, memory_};

    real impacts_{}, most_events_{}, most_impacts_{};
};

template <int N, class Flow, class Guarded, class Host>
using mode_run = packs_run<mode_pack<N, Flow, Guarded, Host>, packs_in_turn<pack<N>>, Host>;

} // namespace vi
