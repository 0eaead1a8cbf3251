// Running the members of a batch, for one flow of the kernel.
#pragma once

#include <cstdint>
#include <memory>

#include "batch_results.hpp"
#include "system_of.hpp"

namespace binding {

inline constexpr std::size_t members_between_questions = 64; // about Ctrl-C

// One system of a batch; modes of closed contacts are built when a member first wants them.
template <class Flow>
class built_system {
    static constexpr int D = Flow::max_dimension;
    using guard = vi::guard<double, D>;

public:
    built_system(const batch_data& batch, const observer_options& options, std::size_t s)
        : batch_(batch), options_(options), s_(s), system_(system_at(batch, s)) {
        system_.reserve_modes(batch.modes.size());
        add(batch.modes.front());
    }

    const system_of<Flow>& system() const { return system_; }
    std::size_t index() const { return s_; }

    // Build the mode of this closed set; false if the batch has none.
    bool build(int code) {
        for (const auto& mode : batch_.modes)
            if (mode.code == code) {
                add(mode);
                return true;
            }
        return false;
    }

    // Lend rows to observers; again after every build.
    void lend(vi::observers<Flow>& all) const {
        const auto omegas = batch_.omegas.data() + s_ * batch_.lines;
        const vi::physical_rows rows{system_.physical()[0],
                                     batch_.lines ? omegas[0] : 1.0 / batch_.steps[s_]};
        for (auto* symbol : {&all.symbol, &all.settling.orbit}) {
            symbol->rows = rows;
            symbol->omega = batch_.lines ? omegas[0] : 0.0;
        }
        all.extremes.watched = {extremes_.data(), count_of(options_.extremes)};
        all.averages.watched = {averages_.data(), count_of(options_.averages)};
    }

private:
    int count_of(const numbers& rows) const {
        return static_cast<int>(rows.size() / batch_.degrees);
    }

    void add(const batch_mode& mode) {
        system_.add_mode(mode_at(batch_, mode, s_));
        watch(extremes_, options_.extremes);
        watch(averages_, options_.averages);
    }

    // row . x as a row on the coordinates of the mode that was added last.
    void watch(std::vector<guard>& to, const numbers& rows) const {
        const int m = system_.hybrid().mode_count - 1, degrees = static_cast<int>(batch_.degrees);
        for (int r = 0; r < count_of(rows); ++r)
            vi::set_watched(to.emplace_back(), rows.data() + r * degrees, system_.physical()[m],
                            system_.hybrid().modes[m].flow);
    }

    const batch_data& batch_;
    const observer_options& options_;
    std::size_t s_;
    system_of<Flow> system_;
    std::vector<guard> extremes_, averages_;
};

// A place for one member at a time, with its system and what observers need.
template <class Flow>
class berth {
    using Shape = typename Flow::shape_type;
    static constexpr int most_exponents = Flow::max_dimension - 1;

public:
    berth(const batch_data& batch, const members& all, const observer_options& options,
          observed& out)
        : batch_(batch), members_(all), options_(options), out_(out), points_(options.last),
          kept_(options.longest) {}

    // Take in member i; false if it is done already, its start being behind a stop.
    bool board(std::size_t i) {
        i_ = i;
        const auto s = static_cast<std::size_t>(members_.system[i]);
        if (!system_ || system_->index() != s)
            system_ = std::make_unique<built_system<Flow>>(batch_, options_, s);
        member_ = {system_->system().template begin<double>(start_of(i))};
        out_.time.row(i)[0] = 0.0;
        if (vi::behind_stop(hybrid(), member_.at)) {
            set_end(vi::member_end::behind_stop);
            return false;
        }
        start_ = member_.at;
        window_ = {members_.settle[i], members_.observe[i], members_.most_impacts,
                   members_.interrupted};
        prepare_observers();
        return true;
    }

    const vi::hybrid<Flow>& hybrid() const { return system_->system().hybrid(); }
    vi::member<double, Flow>& member() { return member_; }
    vi::observers<Flow>& observers() { return all_; }
    const vi::window& window() const { return window_; }
    bool wants_tangents() const { return options_.spectrum || options_.lyapunov; }

    bool build(int code) {
        const bool built = system_->build(code);
        if (built) system_->lend(all_);
        return built;
    }

    // Write down what was seen.
    void leave(vi::member_end end) { leave(end, vi::growth<1>{}); }

    // Carry tangents through what is left of the window, then leave.
    void leave_with_tangents() {
        if (options_.spectrum)
            carry<most_exponents>(static_cast<int>(out_.spectrum.width));
        else
            carry<1>(1);
    }

private:
    auto builder() {
        return [this](int code) { return build(code); };
    }

    template <int W>
    void carry(int count) {
        vi::growth<W> tangents;
        tangents.count = count;
        auto more = builder();
        const auto end = vi::finish_with_tangents(hybrid(), member_, window_, all_, tangents, more);
        leave(end, tangents);
    }

    template <int W>
    void leave(vi::member_end end, const vi::growth<W>& tangents) {
        const double time = member_.so_far.now.time(), omega = all_.symbol.omega;
        const double period = omega > 0.0 ? 2.0 * vi::pi / omega : vi::not_a_number();
        const member_results<Flow> results(out_, i_, system_->system().physical(),
                                           hybrid().dimension(), period, time - window_.settle);
        out_.time.row(i_)[0] = time;
        results.write(all_);
        results.write(tangents);
        results.write_final(member_.at);
        if (all_.wants(vi::sees_settling)) {
            auto more = builder();
            out_.settling.row(i_)[0] = vi::settling_time(hybrid(), start_, window_, all_.settling,
                                                         member_.so_far.impacts, more);
        }
        set_end(end);
    }

    void set_end(vi::member_end end) { out_.end[i_] = static_cast<std::int8_t>(end); }

    start_data start_of(std::size_t i) const {
        const auto row = [&](const numbers& all, std::size_t width) {
            const auto from = all.begin() + static_cast<std::ptrdiff_t>(i * width);
            return numbers(from, from + static_cast<std::ptrdiff_t>(width));
        };
        return {row(members_.position, batch_.degrees), row(members_.velocity, batch_.degrees),
                row(members_.phases, batch_.lines)};
    }

    void prepare_observers() {
        all_ = {};
        all_.wanted = options_.wanted;
        all_.settle = window_.settle;
        all_.section.contact = options_.contact;
        all_.section.side = options_.side;
        all_.section.last = options_.last;
        all_.section.stride = options_.stride;
        all_.section.points = points_.data();
        all_.symbol.tolerance = options_.symbol_tolerance;
        all_.symbol.returns = options_.symbol_returns;
        all_.settling.orbit.tolerance = options_.settling_tolerance;
        all_.settling.orbit.returns = options_.settling_returns;
        all_.settling.longest = options_.longest;
        all_.settling.kept = kept_.data();
        system_->lend(all_);
        all_.depart(member_.at);
    }

    const batch_data& batch_;
    const members& members_;
    const observer_options& options_;
    observed& out_;
    std::vector<vi::section_point<Shape>> points_;
    std::vector<vi::kept_impact<Shape>> kept_;
    std::unique_ptr<built_system<Flow>> system_;
    std::size_t i_ = 0;
    vi::member<double, Flow> member_;
    vi::trajectory<double, Shape> start_;
    vi::window window_{};
    vi::observers<Flow> all_;
};

// The members one after the other.
template <class Flow>
observed run_alone(const batch_data& batch, const members& all, const observer_options& options) {
    observed out(batch, options, all.count());
    berth<Flow> here(batch, all, options, out);
    auto build = [&](int code) { return here.build(code); };
    for (std::size_t i = 0; i < all.count(); ++i) {
        if (i % members_between_questions == 0 && all.interrupted()) break;
        if (!here.board(i)) continue;
        const double begin =
            here.wants_tangents() ? vi::begin_of_tangents(here.window()) : vi::infinity();
        const auto end = begin > 0.0 ? vi::run_until(here.hybrid(), here.member(), here.window(),
                                                     here.observers(), begin, build)
                                     : vi::run_end::observer;
        if (end == vi::run_end::observer)
            here.leave_with_tangents();
        else
            here.leave(vi::end_of_member(end));
    }
    return out;
}

} // namespace binding
