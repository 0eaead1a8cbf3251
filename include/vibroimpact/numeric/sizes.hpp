// Sizes, and the small arrays that have them.
//
// A system is compiled for a shape: how many coordinates y has, how many of their last pairs are
// forcing lines, and how many contacts there are. fixed<D, L, N> means exactly that many, known to
// the compiler; bounded<D, N> at most that many, the numbers being read from the system. Loops run in
// the same order in both, so a system gives the same bits in either shape. It may be mixed: positions
// of the mechanism then show q' of its blocks, too (flow/modal.hpp).
#pragma once

#include "vibroimpact/numeric/concepts.hpp"

namespace vi {

// The largest mechanism, and the largest whose modes may have blocks: states are copied at every event, and longer
// arrays cost all of them. Python reads these limits.
inline constexpr int max_degrees = 20, most_contacts = 16, max_lines = 12;
inline constexpr int block_degrees = 10, block_contacts = 8, block_lines = 6;
inline constexpr int most_elements = 8; // with states of their own: soft stops, friction
inline constexpr int largest_dimension = 2 * (max_degrees + max_lines);
inline constexpr int block_dimension = 2 * (block_degrees + block_lines);

template <int Dimension, int Lines, int Contacts, bool Exact, bool Mixed = false, int Elements = 0>
struct shape {
    static constexpr int max_dimension = Dimension;
    static constexpr int exact_lines = Lines;
    static constexpr int max_contacts = Contacts;
    static constexpr bool exact = Exact;
    static constexpr bool exact_contacts = Exact;
    static constexpr bool mixed = Mixed; // of an exact one
    static constexpr int max_elements = Elements;
    static constexpr int max_watches = 3 * Elements; // guards of elements in a mode
};
template <int Dimension, int Lines, int Contacts, bool Mixed = false>
using fixed = shape<Dimension, Lines, Contacts, true, Mixed>;
template <int Dimension, int Contacts>
using bounded = shape<Dimension, 0, Contacts, false>;
using any_size = bounded<block_dimension, block_contacts>;
using any_elements = shape<largest_dimension, 0, most_contacts, false, false, most_elements>;

// A whole number that the compiler knows.
template <int I>
struct constant {
    VI_HD constexpr operator int() const { return I; }
};

// body(i) for i = From, ..., To - 1, each known to the compiler: what arrays hold at such places
// stays in registers. Several in a call: compilers optimise each call of a nest by itself.
template <int From, int To, class F>
VI_HOT constexpr void unrolled(const F& body) {
    if constexpr (From < To) body(constant<From>{});
    if constexpr (From + 1 < To) body(constant<From + 1>{});
    if constexpr (From + 2 < To) body(constant<From + 2>{});
    if constexpr (From + 3 < To) body(constant<From + 3>{});
    if constexpr (From + 4 < To) unrolled<From + 4, To>(body);
}

// The sizes in use; a fixed shape ignores what is stored.
template <class Shape>
struct sizes {
    int dimension_ = Shape::max_dimension;
    int lines_ = Shape::exact_lines;
    int contacts_ = Shape::max_contacts;
    bool mixed_ = Shape::mixed;

    VI_HD constexpr int dimension() const {
        return Shape::exact ? Shape::max_dimension : dimension_;
    }
    VI_HD constexpr int lines() const { return Shape::exact ? Shape::exact_lines : lines_; }
    VI_HD constexpr int blocks() const { return dimension() / 2; }
    VI_HD constexpr int oscillators() const { return blocks() - lines(); }
    VI_HD constexpr int contacts() const {
        return Shape::exact_contacts ? Shape::max_contacts : contacts_;
    }
    VI_HD constexpr bool mixed() const { return Shape::exact ? Shape::mixed : mixed_; }

    // Loops, unrolled in a fixed shape.
    template <class F>
    VI_HOT constexpr void each_coordinate(const F& body) const {
        loop<0, Shape::max_dimension>(0, dimension_, body);
    }
    template <class F>
    VI_HOT constexpr void each_oscillator(const F& body) const {
        loop<0, first_line>(0, oscillators(), body);
    }
    template <class F>
    VI_HOT constexpr void each_line(const F& body) const {
        loop<first_line, Shape::max_dimension / 2>(oscillators(), blocks(), body);
    }
    template <class F>
    VI_HOT constexpr void each_contact(const F& body) const {
        loop<0, Shape::max_contacts, Shape::exact_contacts>(0, contacts_, body);
    }

private:
    static constexpr int first_line = Shape::max_dimension / 2 - Shape::exact_lines;

    template <int From, int To, bool Exact = Shape::exact, class F>
    VI_HOT static constexpr void loop(int from, int to, const F& body) {
        if constexpr (Exact) {
            unrolled<From, To>(body);
        } else {
            for (int i = from; i < to; ++i)
                body(i);
        }
    }
};

template <class T, int N>
struct vec {
    T x[N];
    VI_HD constexpr T& operator[](int i) { return x[i]; }
    VI_HD constexpr const T& operator[](int i) const { return x[i]; }
};

// c + r . y over the first n entries, n even: even entries and odd ones apart, so that half as many
// sums wait for each other.
template <class T, class R, class C, int N>
VI_HD constexpr T dot(const vec<R, N>& r, const vec<T, N>& y, int n, const C& c) {
    T even = fma(r[0], y[0], c), odd = r[1] * y[1];
    for (int i = 2; i < n; i += 2) {
        even = fma(r[i], y[i], even);
        odd = fma(r[i + 1], y[i + 1], odd);
    }
    return even + odd;
}
template <class T, class R, int N>
VI_HD constexpr T dot(const vec<R, N>& r, const vec<T, N>& y, int n) {
    return dot(r, y, n, R(0.0));
}

} // namespace vi
