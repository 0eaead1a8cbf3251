// All observers: as a batch declares them, and as a member carries them.
//
// One function, compiled once, serves every combination; an observer that is not wanted costs a
// test of its bit per event in the window.
#pragma once

#include "vibroimpact/observe/registry.hpp"

namespace vi {

namespace detail {

// Bit of one observer of a list.
template <class Wanted, class... All>
constexpr unsigned observer_bit(observer_list<All...>) {
    static_assert(sizeof...(All) <= 32);
    unsigned bit = 1, found = 0;
    ((found |= is_same<Wanted, All> ? bit : 0u, bit <<= 1), ...);
    return found;
}

// A part of a structure that has one part per observer.
template <class T>
struct part_of_all {
    T value{};
};

} // namespace detail

// Options and results of every observer for one batch, and which are wanted.
template <class List>
struct declarations_of;
template <class... All>
// One base for each type of the list holds it: NOLINTNEXTLINE(misc-multiple-inheritance)
struct declarations_of<observer_list<All...>> : detail::part_of_all<All>... {
    unsigned wanted = 0;

    template <class One>
    static constexpr unsigned bit = detail::observer_bit<One>(observer_list<All...>{});

    // visit(observer) for each of them; for those that are wanted.
    template <class Visit>
    void each(const Visit& visit) {
        (visit(detail::part_of_all<All>::value), ...);
    }
    template <class Visit>
    void each_wanted(const Visit& visit) {
        ((wanted & bit<All> ? visit(detail::part_of_all<All>::value) : void()), ...);
    }
    template <class Visit>
    VI_HD void each_wanted(const Visit& visit) const {
        ((wanted & bit<All> ? visit(detail::part_of_all<All>::value) : void()), ...);
    }

    // Rows to be watched in every mode, and tangent vectors to be carried along.
    VI_HD long long watched() const {
        long long count = 0;
        each_wanted([&](const auto& one) {
            if constexpr (requires { one.rows; }) count += one.rows.count;
        });
        return count;
    }
    long long tangents(const batch_sizes& sizes) const {
        long long count = 0;
        each_wanted([&](const auto& one) {
            if constexpr (requires { one.tangents(sizes); })
                count = one.tangents(sizes) > count ? one.tangents(sizes) : count;
        });
        return count;
    }
};
using observer_declarations = declarations_of<all_observers>;

// State of every observer, as one member carries it.
template <class Flow, class List>
struct observers_of;
template <class Flow, class... All>
struct observers_of<Flow, observer_list<All...>> {
    using Shape = typename Flow::shape_type;
    using declarations = declarations_of<observer_list<All...>>;
    template <class One>
    using observer = typename One::template observer<Flow>;
    template <class One>
    static constexpr unsigned bit = declarations::template bit<One>;

    static constexpr unsigned of_events =
        (0u | ... | (requires { &observer<All>::on_event; } ? bit<All> : 0u));
    static constexpr unsigned of_flights =
        (0u | ... | (requires { &observer<All>::on_flight; } ? bit<All> : 0u));

    VI_HD bool wants(unsigned bits) const { return (wanted_ & bits) != 0; }

    // From what time on events are to be shown.
    VI_HD double shown_from() const {
        return wants(of_flights) ? 0.0 : wants(of_events) ? settle_ : infinity();
    }
    VI_HD void set_interrupted(bool (*interrupted)()) { interrupted_ = interrupted; }

    // Give memory to the observers that borrow some: allocate(count, element*&).
    template <class Allocate>
    void borrow(const declarations& declared, const Allocate& allocate) {
        declared.each_wanted([&]<class One>(const One& one) {
            if constexpr (requires { one.borrows(); }) allocate(one.borrows(), of<One>().memory);
        });
    }

    // Begin anew, for a member that is about to start. Observers that are not wanted keep their old
    // values, which are not read.
    VI_HD void begin(const declarations& declared, const member_start<Flow>& m,
                     const trajectory<double, Shape>& at) {
        wanted_ = declared.wanted;
        settle_ = m.settle;
        auto watched = m.watched;
        declared.each_wanted([&]<class One>(const One& one) {
            auto& here = of<One>();
            observer<One> fresh{};
            if constexpr (requires { here.memory; }) fresh.memory = here.memory;
            if constexpr (requires { here.watched; }) {
                watched.count = static_cast<int>(one.rows.count);
                fresh.watched = watched;
                watched.rows += watched.count;
            }
            here = fresh;
            if constexpr (requires { &observer<One>::prepare; }) here.prepare(one, m);
        });
        depart(at);
    }

    // To be called after every event, those before the window included.
    VI_HD void on_event(const hybrid<Flow>& system, const event<double, Shape>& e,
                        const trajectory<double, Shape>& at, const clock& now) {
        const double time = now.time();
        if (time >= settle_) {
            if (wants(of_flights))
                show(segment_before_event(system, before_, e.duration,
                                          settle_ - (time - e.duration), time, interrupted_));
            show(event_view<Flow>{system, e, at, time});
        }
        depart(at);
    }

    // Write rows of a finished member: of whole windows, or only what is known of any run.
    template <class Member>
    VI_HD void write(const declarations& declared, const Member& m, bool whole) const {
        declared.each_wanted([&]<class One>(const One& one) {
            if (whole || requires { One::of_any_end; }) of<One>().write(m, one);
        });
    }

private:
    template <class One>
    using part = detail::part_of_all<observer<One>>;
    struct all_parts : part<All>... {};

    template <class One>
    VI_HD observer<One>& of() {
        return static_cast<part<One>&>(parts_).value;
    }
    template <class One>
    VI_HD const observer<One>& of() const {
        return static_cast<const part<One>&>(parts_).value;
    }

    VI_HOT void depart(const trajectory<double, Shape>& from) {
        if (wants(of_flights)) before_ = from;
    }
    VI_HOT void show(const flight_segment<Flow>& s) { (show<All>(s), ...); }
    VI_HOT void show(const event_view<Flow>& s) { (show<All>(s), ...); }
    template <class One>
    VI_HOT void show(const flight_segment<Flow>& s) {
        if constexpr (requires { &observer<One>::on_flight; })
            if (wants(bit<One>)) of<One>().on_flight(s);
    }
    template <class One>
    VI_HOT void show(const event_view<Flow>& s) {
        if constexpr (requires { &observer<One>::on_event; })
            if (wants(bit<One>)) of<One>().on_event(s);
    }

    unsigned wanted_ = 0;
    double settle_ = 0.0; // events before this time are not shown
    bool (*interrupted_)() = nullptr;
    all_parts parts_{};
    trajectory<double, Shape> before_{}; // the trajectory before the event, where flights are seen
};
template <class Flow>
using observers = observers_of<Flow, all_observers>;

} // namespace vi
