// Running the members of a batch, for one flow of the kernel.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "ensemble/batch.hpp"
#include "vibroimpact/ensemble/member.hpp"

namespace binding {

inline constexpr long long members_between_questions = 64; // about Ctrl-C

// One system of a batch; modes of closed contacts are built when a member first wants them.
template <class Flow>
class built_system {
    using room = vi::system_room<Flow>;
    using mode = vi::mode<double, Flow>;
    static constexpr int not_built = -2; // no closed set has this code

public:
    explicit built_system(const batch_run& b)
        : numbers_(b.numbers), b_(b.arrays), codes_(b_.modes),
          modes_(std::make_unique_for_overwrite<mode[]>(b_.modes)), from_free_(b_.modes),
          to_free_(b_.modes), extremes_(b_.modes * b_.extremes_count),
          averages_(b_.modes * b_.averages_count) {
        numbers_.lend(b_);
    }

    long long number() const { return s_; }

    // Become system s.
    void become(long long s) {
        s_ = s;
        ++version_;
        numbers_.become(s);
        std::fill(codes_.begin(), codes_.end(), not_built);
        vi::build_system(b_, 0, in());
        system_.codes = codes_.data();
        (*this)(b_.codes[0]);
    }

    // Build the mode of this closed set; false if the batch has none.
    bool operator()(int code) {
        const auto m = std::find(b_.codes, b_.codes + b_.modes, code) - b_.codes;
        if (m == b_.modes) return false;
        std::construct_at(&modes_[m]);
        vi::build_mode(b_, m, 0, in());
        codes_[m] = code;
        return true;
    }

    const vi::batch_arrays& arrays() const { return b_; }
    const vi::hybrid<Flow>& system() const { return system_; }
    long version() const { return version_; }
    room in() {
        return {&system_,        modes_.get(),     from_free_.data(),
                to_free_.data(), extremes_.data(), averages_.data()};
    }

private:
    system_numbers numbers_;
    vi::batch_arrays b_; // of this one system
    long long s_ = -1;
    long version_ = 0; // so many systems have been here
    vi::hybrid<Flow> system_{};
    std::vector<int> codes_;
    std::unique_ptr<mode[]> modes_;
    std::vector<typename room::map_type> from_free_, to_free_;
    std::vector<typename room::watched> extremes_, averages_;
};

// The systems that members are in. A member that follows another of its system shares it: members of
// one system are to stand next to each other.
template <class Flow>
class built_systems {
public:
    using shared = std::shared_ptr<built_system<Flow>>;

    explicit built_systems(const batch_run& b) : b_(b) {}

    shared of(long long s) {
        if (!latest_ || latest_->number() != s) {
            latest_.reset();
            latest_ = idle();
            latest_->become(s);
        }
        return latest_;
    }

private:
    shared idle() {
        for (const auto& one : all_)
            if (one.use_count() == 1) return one;
        return all_.emplace_back(std::make_shared<built_system<Flow>>(b_));
    }

    const batch_run& b_;
    std::vector<shared> all_;
    shared latest_;
};

// A place for one member at a time, with its system and what observers need.
template <class Flow>
class berth {
    using Shape = typename Flow::shape_type;
    static constexpr int most_exponents = Flow::max_dimension - 1;

public:
    berth(const batch_run& b, built_systems<Flow>& systems, question ask)
        : b_(b), ask_(ask), systems_(systems), points_(b.arrays.last + b.arrays.strobe_last),
          kept_(b.arrays.longest) {}

    // Take in member i; false if it is done already, its start being behind a stop.
    bool board(long long i) {
        i_ = i;
        built_.reset();
        built_ = systems_.of(b_.system[i]);
        if (!vi::board(built_->arrays(), i, built_->in(), {points_.data(), kept_.data()}, here_))
            return false;
        here_.window.interrupted = here_.observers.interrupted = ask_;
        until_ = b_.arrays.exponents ? vi::begin_of_tangents(here_.window) : vi::infinity();
        return true;
    }

    const vi::hybrid<Flow>& hybrid() const { return built_->system(); }
    long version() const { return built_->version(); }
    vi::motion<double, Flow>& motion() { return here_.now; }
    vi::observers<Flow>& observers() { return here_.observers; }
    const vi::window& window() const { return here_.window; }
    bool build(int code) { return (*built_)(code); }

    // When tangents begin.
    double until() const { return until_; }

    // Run the member up to there.
    vi::run_end run() {
        return until_ > 0.0 ? vi::run_until(hybrid(), here_.now, here_.window, here_.observers,
                                            until_, *built_)
                            : vi::run_end::observer;
    }

    // After a run: carry tangents through what is left of the window, and write down what was seen.
    void finish(vi::run_end why) {
        if (why != vi::run_end::observer)
            leave(vi::end_of_member(why), vi::growth<1>{});
        else if (b_.arrays.spectrum)
            finish_with_tangents<most_exponents>();
        else
            finish_with_tangents<1>();
    }

    // Write down what was seen, tangents having been carried along.
    template <int W>
    void leave(vi::member_end end, const vi::growth<W>& tangents) {
        vi::leave(built_->arrays(), i_, hybrid(), here_, end, tangents, *built_);
    }

private:
    template <int W>
    void finish_with_tangents() {
        vi::growth<W> tangents;
        tangents.count = static_cast<int>(b_.arrays.exponents);
        const auto end = vi::finish_with_tangents(hybrid(), here_.now, here_.window,
                                                  here_.observers, tangents, *built_);
        leave(end, tangents);
    }

    const batch_run& b_;
    question ask_;
    built_systems<Flow>& systems_;
    typename built_systems<Flow>::shared built_;
    std::vector<vi::section_point<Shape>> points_;
    std::vector<vi::kept_impact<Shape>> kept_;
    long long i_ = 0;
    double until_ = 0.0;
    vi::passage<Flow> here_{};
};

// The members one after the other.
template <class Flow>
void run_alone(const batch_run& b, question ask) {
    built_systems<Flow> systems(b);
    berth<Flow> here(b, systems, ask);
    for (long long i = 0; i < b.arrays.members; ++i) {
        if (i % members_between_questions == 0 && ask()) return;
        if (here.board(i)) here.finish(here.run());
    }
}

} // namespace binding
