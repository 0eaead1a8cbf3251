// A double that counts what is done to it: how many operations does an algorithm really cost?
//
// The counts live in the program that asks, not here. It names them by a tag:
//
//     struct flight_cost { static inline vi::operation_counts counts; };
//     using number = vi::counting<flight_cost>;
//     number y = exp(number(0.5));
//     // flight_cost::counts.multiplications ...
//
// Two tags count apart. Elementary functions count as the operations they consist of. Not counted:
// negation, select, copies, and work on bit patterns, which hide behind arithmetic.
#pragma once

#include "vibroimpact/numeric/concepts.hpp"

namespace vi {

struct operation_counts {
    unsigned long long additions = 0; // and subtractions
    unsigned long long multiplications = 0;
    unsigned long long fused = 0; // each counts for two
    unsigned long long divisions = 0;
    unsigned long long square_roots = 0;
    unsigned long long comparisons = 0;

    VI_HD constexpr unsigned long long flops() const {
        return additions + multiplications + 2 * fused + divisions + square_roots;
    }
};

template <class Tag>
struct counting {
    double v = 0.0;

    counting() = default;
    VI_HD counting(double x) : v(x) {}
    VI_HD static counting from_bits(unsigned long long b) { return vi::from_bits<double>(b); }

    VI_HD friend counting operator+(counting a, counting b) {
        ++Tag::counts.additions;
        return a.v + b.v;
    }
    VI_HD friend counting operator-(counting a, counting b) {
        ++Tag::counts.additions;
        return a.v - b.v;
    }
    VI_HD friend counting operator*(counting a, counting b) {
        ++Tag::counts.multiplications;
        return a.v * b.v;
    }
    VI_HD friend counting operator/(counting a, counting b) {
        ++Tag::counts.divisions;
        return a.v / b.v;
    }
    VI_HD friend counting operator-(counting a) { return -a.v; }
    VI_HD counting& operator+=(counting b) { return *this = *this + b; }
    VI_HD counting& operator-=(counting b) { return *this = *this - b; }
    VI_HD counting& operator*=(counting b) { return *this = *this * b; }
    VI_HD counting& operator/=(counting b) { return *this = *this / b; }

    VI_HD friend bool operator<(counting a, counting b) { return compared(a.v < b.v); }
    VI_HD friend bool operator<=(counting a, counting b) { return compared(a.v <= b.v); }
    VI_HD friend bool operator>(counting a, counting b) { return compared(a.v > b.v); }
    VI_HD friend bool operator>=(counting a, counting b) { return compared(a.v >= b.v); }
    VI_HD friend bool operator==(counting a, counting b) { return compared(a.v == b.v); }
    VI_HD friend bool operator!=(counting a, counting b) { return compared(a.v != b.v); }

    VI_HD friend counting sqrt(counting x) {
        ++Tag::counts.square_roots;
        return sqrt(x.v);
    }
    VI_HD friend counting fma(counting a, counting b, counting c) {
        ++Tag::counts.fused;
        return fma(a.v, b.v, c.v);
    }
    VI_HD friend counting fnma(counting a, counting b, counting c) { return fma(-a, b, c); }
    VI_HD friend counting select(bool mask, counting a, counting b) { return mask ? a : b; }
    VI_HD friend counting value(counting x) { return x; }
    VI_HD friend double plain(counting x) { return x.v; }
    VI_HD friend counting lane(counting x, int) { return x; }
    VI_HD friend void set_lane(counting& x, int, counting s) { x = s; }
    VI_HD friend unsigned long long bits(counting x) { return bits(x.v); }

private:
    VI_HD static bool compared(bool outcome) {
        ++Tag::counts.comparisons;
        return outcome;
    }
};

template <class Tag>
struct scalar_traits<counting<Tag>> {
    using real = counting<Tag>;
    using mask = bool;
    using lane = counting<Tag>;
    using bits = unsigned long long;
    static constexpr int lanes = 1;
    static constexpr bool is_jet = false;
};

} // namespace vi
