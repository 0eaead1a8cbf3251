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
            for (int j = 0; j < n; ++j)
                set_lane(to.powers[k].e[r][j], i, from.powers[k].e[r][j]);
            set_lane(to.powers[k].shift[r], i, from.powers[k].shift[r]);
        }
    for (int r = 0; r < n; ++r) {
        for (int j = 0; j < n; ++j)
            set_lane(to.b[r][j], i, from.b[r][j]);
        set_lane(to.constant[r], i, from.constant[r]);
    }
    set_lane(to.step, i, from.step);
    for (int g = 0; g < grids; ++g) {
        set_lane(to.spacing[g], i, from.spacing[g]);
        set_lane(to.grid_error[g], i, from.grid_error[g]);
    }
    set_lane(to.scan_length, i, from.scan_length);
}

// In place of a dimension that differs.
template <int N, int D, int E>
inline void fill_row(vec<pack<N>, D>& to, const vec<double, E>& from, int n, int i) {
    for (int j = 0; j < n; ++j)
        set_lane(to[j], i, from[j]);
}

template <int N, class Guarded, class From>
inline void fill_quick_guard(quick_guard<pack<N>, Guarded>& to, const From& from, int n, int i) {
    for (int m = 0; m <= to.orders; ++m) {
        fill_row(to.rows[m], from.rows[m], n, i);
        set_lane(to.gains[m], i, from.gains[m]);
    }
    for (int grid = 0; grid < grids; ++grid) {
        auto& rows = to.ahead[grid];
        for (int k = 0; k < rows.count; ++k) {
            for (int j = 0; j < n; ++j)
                set_lane(rows.rows[j][k], i, from.ahead[grid].rows[j][k]);
            set_lane(rows.gains[k], i, from.ahead[grid].gains[k]);
        }
        rows.shifted = rows.shifted | from.ahead[grid].shifted;
    }
    fill_row(to.fourth, from.fourth, n, i);
    fill_row(to.weights, from.weights, n, i);
    set_lane(to.least_fourth, i, from.least_fourth);
    set_lane(to.least_terms, i, from.least_terms);
    set_lane(to.lower, i, from.lower);
    set_lane(to.upper, i, from.upper);
}

template <int N, int D, class Watch, class Flow>
inline void fill_watch(watch_view<pack<N>, D>& to, const Watch& from, const Flow& flow, int i) {
    const int n = flow.dimension();
    for (int m = 0; m < 2; ++m) {
        fill_row(to.rows[m], from.row.rows[m], n, i);
        set_lane(to.gains[m], i, from.row.gains[m]);
        double size = 0.0;
        for (int j = 0; j < n; ++j)
            size = size + (abs(from.row.rows[m][j]) + flow.step * abs(from.row.rows[m + 1][j]));
        set_lane(to.sizes[m], i, size);
        set_lane(to.adds[m], i, abs(from.row.gains[m]) + flow.step * abs(from.row.gains[m + 1]));
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
        fill_watch(to.watches[j], from.watched.at[j], from.flow, i);
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
class mode_pack {
    using Shape = typename Flow::shape_type;
    using real = pack<N>;
    using mask = pack_mask<N>;
    using state = vec<real, Guarded::max_dimension>;
    using landed_on = quick_landing<real>;
    using scalar = trajectory<double, Shape>;
    using round_type = quick_round<real, quick_mode<real, Guarded>, Guarded>;
    static constexpr int W = Shape::max_watches, E = Shape::max_elements;

public:
    // Lane i of the pack is lane first + i of the host.
    void begin_runs(Host& host, int first, long& work) {
        host_ = &host;
        first_ = first;
        work_ = &work;
        count_ = host.modes();
        for (int m = 0; m < count_; ++m)
            codes_[m] = host.code(m);
        fill();
    }
    bool busy() const { return runs_ > 0; }
    bool flies() const { return any(going_); }

    // A round: begin(); where any lane flies scan() and evaluate() of a round(), its stages, transitions().
    VI_HOT void begin() {
        now_ = fullest();
        going_ = in_[now_];
        if (!flies()) return;
        const auto& mode = modes_[now_].quick;
        round_.use(mode);
        round_.begin(going_ & may_go_on(mode.flow, flown_, until_ - (high_ + low_)));
    }
    VI_HOT auto& round() { return round_; }
    template <class Take>
    VI_HOT static void each_stage(const Take& take) {
        round_type::each_stage(take);
    }
    VI_HOT void transitions() {
        landed_on end;
        state y;
        end.landed = end.moved = mask(false);
        if (flies()) round_.template land<false>(end, y);
        end.landed = end.landed & going_;
        go_on(end.moved & going_, end, y);
        const mask wanted = end.landed & (end.duration > 0.0);
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
        count(taken, end.duration);
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
            const auto& guard = mode.quick.guards[g];
            const real u = guard_distance(guard, y, flow);
            const real margin = proof_margin * detail::terms_of(guard, flow, y);
            out = out & (u < guard.upper - margin) & (u > guard.lower + margin);
        }
        return out;
    }

    // The state that follows of one element, all others being inside their limits. Lanes where that is sure.
    VI_HOT mask take_state_of(int e, const mask& lanes, const state& y, const real& largest) {
        mask open = lanes, sure = lanes, by_law = mask(false), takes[radix];
        for (int s = radix - 1; s >= 0; --s) {
            takes[s] = mask(false);
            if (!(states_[e] >> s & 1)) continue;
            const int n = with_state(e, s);
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
            enter(with_state(e, s), mine, y, largest);
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

    VI_HOT void count(const mask& lanes, const real& duration) {
        const real t = only(lanes, duration);
        const real sum = high_ + t, part = sum - high_; // clock::add
        low_ = low_ + ((high_ - (sum - part)) + (t - part));
        high_ = sum;
        events_ = plus_where(lanes, events_, real(1.0));
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
            e.side = met ? (is == 1 ? 1 : -1) : static_cast<int>(lane(end.stop.side, i));
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
        auto& slot = slots_[i];
        more_ = host_->next(first_ + i, slot);
        while (more_ && slot.run->so_far.events >= slot.limit.events) {
            host_->end(first_ + i, slot, run_end::events);
            more_ = host_->next(first_ + i, slot);
        }
        if (!more_) return;
        ++runs_;
        set_lane(busy_, i, true);
        const auto& system = *slot.system;
        if (keys_.put(i, system, slot.version)) put_system(i, system);
        set_lane(until_, i, slot.limit.t_max);
        set_lane(shown_from_, i, slot.shown_from);
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
            at.touching[k] = 0.0;
        for (int g = 0; g < quick.flow.contacts() && !flies; ++g) {
            const int number = quick.number[g], j = number - contacts_;
            const double side = lane(at_.touching[g], i);
            if (j < 0) {
                at.touching[number] = side;
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
            return resume(i, e.duration, e.code);
        }
        if (e.what == status::missing_mode) {
            at = start;
            return request_mode(i, e.code);
        }
        if (report(i, e)) resume(i);
    }

    bool report(int i, const event<double, Shape>& e) {
        vi::count(slots_[i].run->so_far, e);
        return inform(i, e);
    }

    // Of an event that is counted; false if it is the last.
    bool inform(int i, const event<double, Shape>& e) {
        const auto& slot = slots_[i];
        const auto& [at, so_far] = *slot.run;
        const bool shown = so_far.now.time() >= slot.shown_from;
        const bool goes_on = !shown || host_->see(first_ + i, e, at, so_far.now);
        run_end why = end_of_run(so_far, e, slot.limit, true);
        if (why == run_end::none && !goes_on) why = run_end::observer;
        if (why == run_end::none && so_far.events >= slot.limit.events) why = run_end::events;
        if (why != run_end::none) finish(i, why);
        return why == run_end::none;
    }

    // The event did not happen yet: the flight goes on from where it was.
    void request_mode(int i, int code) {
        if (code < 0 || !host_->build(first_ + i, code)) return finish(i, run_end::missing);
        resume(i, lane(flown_, i), static_cast<int>(lane(applications_, i)));
    }

    void finish(int i, run_end why) {
        host_->end(first_ + i, slots_[i], why);
        for (int m = 0; m < count_; ++m)
            set_lane(in_[m], i, false);
        set_lane(busy_, i, false);
        --runs_;
    }

    Host* host_ = nullptr;
    long* work_ = nullptr;
    int first_ = 0;
    lane_slot<Flow> slots_[N];
    lane_keys<N, Flow> keys_; // of the systems whose numbers the lanes hold

    int count_ = 0, codes_[most_lane_modes]; // of modes, built or not
    int contacts_ = 0, closed_sets_ = 1, elements_ = 0, states_[E];
    bool soft_[E];
    lane_mode<N, Guarded, W> modes_[most_lane_modes];
    real inverse_omega_squared_[max_lines];

    // Where the lanes are: guards count as those of the mode of each.
    trajectory<real, Guarded> at_{};
    real flown_{}, applications_{}, size_{}, offset_[W]{};
    int mode_[N] = {};
    mask in_[most_lane_modes] = {}; // lanes whose flights in this mode may be quick
    mask quick_{}, changed_{};      // whether that is so in any; what the slot does not know of

    int now_ = 0; // the mode of this round, and its lanes
    mask going_;
    flight_memory<quick_flow<real, Guarded>> memory_;
    round_type round_{modes_[0].quick, at_, flown_, memory_};

    real high_{}, low_{}, until_{}, shown_from_{};
    real events_{}, impacts_{}, most_events_{}, most_impacts_{};
    mask busy_{};
    int runs_ = 0;     // lanes that are busy
    bool more_ = true; // whether the host may have another run
};

template <int N, class Flow, class Guarded, class Host>
class mode_run {
    static constexpr int packs = packs_in_turn<pack<N>>;

public:
    explicit mode_run(Host& host) : host_(host) {}

    void run() {
        for (int i = 0; i < packs; ++i)
            packs_[i].begin_runs(host_, i * N, work_);
        while (busy()) {
            if (++work_ >= between_interrupt_checks) {
                work_ = 0;
                if (host_.interrupted()) return interrupt();
            }
            for (auto& one : packs_)
                if (one.busy()) one.begin();
            each_flying([](auto& round) VI_WITHIN { round.scan(); });
            each_flying([](auto& round) VI_WITHIN { round.evaluate(); });
            pack_type::each_stage([&](const auto& stage) VI_WITHIN { each_flying(stage); });
            for (auto& one : packs_)
                if (one.busy()) one.transitions();
        }
    }

private:
    using pack_type = mode_pack<N, Flow, Guarded, Host>;

    bool busy() const {
        for (const auto& one : packs_)
            if (one.busy()) return true;
        return false;
    }
    template <class Stage>
    VI_HOT void each_flying(const Stage& stage) {
        for (auto& one : packs_)
            if (one.busy() && one.flies()) stage(one.round());
    }
    void interrupt() {
        for (auto& one : packs_)
            one.interrupt();
    }

    Host& host_;
    long work_ = 0;
    spaced<pack_type> packs_[packs];
};

} // namespace vi
