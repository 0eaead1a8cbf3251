// Running the members of a batch, for one flow of the kernel.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "engine/steps.hpp"
#include "ensemble/batch.hpp"
#include "vibroimpact/ensemble/member.hpp"

namespace binding {

inline constexpr long long members_between_checks = 64; // for Ctrl-C

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
          to_free_(b_.modes), resets_(b_.resets), row_count_(b_.observers.watched()),
          rows_(b_.modes * row_count_) {
        numbers_.set_arrays(b_);
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
        for (long long m = 1; b_.given && m < b_.modes; ++m) // watches name them without asking
            (*this)(b_.codes[m]);
    }

    // Build the mode with this code; false if the batch has none. That of the same states without closed contacts
    // is there before.
    bool operator()(int code) {
        const int open = code - code % system_.closed_sets();
        if (code < 0 || (code != open && system_.find_mode(open) < 0 && !(*this)(open)))
            return false;
        const auto m = std::find(b_.codes, b_.codes + b_.modes, code) - b_.codes;
        if (m == b_.modes) return false;
        ::new (static_cast<void*>(&modes_[m]))
            mode; // most of it is filled in, and the rest not read
        vi::build_mode(b_, m, 0, in());
        codes_[m] = code;
        return true;
    }

    const vi::batch_arrays& arrays() const { return b_; }
    const vi::hybrid<Flow>& system() const { return system_; }
    long version() const { return version_; }
    room in() {
        return {&system_,       modes_.get(), from_free_.data(), to_free_.data(),
                resets_.data(), rows_.data(), row_count_};
    }

private:
    system_numbers numbers_;
    vi::batch_arrays b_; // of this one system
    long long s_ = -1;
    long version_ = 0; // so many systems have been here
    vi::hybrid<Flow> system_{};
    std::vector<int> codes_;
    std::unique_ptr<mode[]> modes_;
    std::vector<typename room::map_type> from_free_, to_free_, resets_;
    long long row_count_;
    std::vector<typename room::watched> rows_;
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

// A place for one member at a time, with its system and the memory that observers borrow.
template <class Flow>
class member_slot {
public:
    member_slot(const batch_run& b, built_systems<Flow>& systems, interrupt_check interrupted)
        : b_(b), interrupted_(interrupted), systems_(systems) {
        const auto& arrays = b.arrays;
        tangents_ = static_cast<int>(arrays.observers.tangents(arrays));
        here_.observers.set_interrupted(interrupted);
        here_.observers.borrow(arrays.observers, [&]<class T>(long long count, T*& memory) {
            auto owned = std::make_shared<T[]>(static_cast<std::size_t>(count));
            memory = owned.get();
            memory_.push_back(std::move(owned));
        });
    }

    // Take in member i; false if it is done already, its start being behind a stop.
    bool load(long long i) {
        i_ = i;
        built_.reset();
        built_ = systems_.of(b_.system[i]);
        if (!vi::load_member(built_->arrays(), i, built_->in(), here_, *built_)) return false;
        here_.window.interrupted = interrupted_;
        until_ = tangents_ ? vi::begin_of_tangents(here_.window) : vi::infinity();
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
    int tangents() const { return tangents_; }

    // Run the member up to there.
    vi::run_end run() {
        return until_ > 0.0 ? vi::run_until(hybrid(), here_.now, here_.window, here_.observers,
                                            until_, *built_)
                            : vi::run_end::observer;
    }

    // After a run: carry tangents through what is left of the window, and write down what was seen.
    void finish(vi::run_end why) {
        if (why != vi::run_end::observer)
            finish(vi::end_of_member(why), vi::growth<1>{});
        else if (tangents_ > 1)
            finish_with_tangents<most_exponents<Flow>>();
        else
            finish_with_tangents<1>();
    }

    // Write down what was seen, tangents having been carried along.
    template <int W>
    void finish(vi::member_end end, const vi::growth<W>& grown) {
        double exponents[most_exponents<Flow>];
        for (int k = 0; k < tangents_; ++k)
            exponents[k] = grown.exponent(k);
        vi::finish_member(built_->arrays(), i_, hybrid(), here_, end, exponents, *built_);
    }

private:
    template <int W>
    void finish_with_tangents() {
        vi::growth<W> grown;
        grown.count = tangents_;
        const auto end = vi::finish_with_tangents(hybrid(), here_.now, here_.window,
                                                  here_.observers, grown, *built_);
        finish(end, grown);
    }

    const batch_run& b_;
    interrupt_check interrupted_;
    built_systems<Flow>& systems_;
    typename built_systems<Flow>::shared built_;
    std::vector<std::shared_ptr<void>> memory_;
    long long i_ = 0;
    int tangents_ = 0; // vectors
    double until_ = 0.0;
    vi::member_state<Flow> here_{};
};

// The members one after the other.
template <class Flow>
void run_alone(const batch_run& b, interrupt_check interrupted) {
    built_systems<Flow> systems(b);
    member_slot<Flow> here(b, systems, interrupted);
    for (long long i = 0; i < b.arrays.members; ++i) {
        if (i % members_between_checks == 0 && interrupted()) return;
        if (here.load(i)) here.finish(here.run());
    }
}

} // namespace binding
