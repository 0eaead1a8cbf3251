// Declaration of an observer: its options, its results, and what it makes of a motion.
//
// To add one: a header here, its include and its name in registry.hpp, a file in
// src/vibroimpact/sweeps/observers; shares.hpp and shares.py are short ones. The header declares a struct
// of namespace vi::observe whose members are options and tables of results, for a whole batch, and whose
// nested template is what one member carries:
//
//     struct pauses {
//         static constexpr const char* name = "pauses";
//         double least = 0.0;
//         result_table statistics{};
//
//         void options(const auto& to) {             by the names that Python has for them
//             to.real("least", least);
//         }
//         void tables(const batch_sizes&, const auto& to) {
//             to("statistics", statistics, 2);       so many numbers per member, NaN where it has none;
//         }                                          a fourth argument takes the place of NaN
//         template <class Flow>
//         struct observer;
//     };
//
// Options are   to.count(name, long, least, most)    a whole number in a range
//               to.share(name, double)               a number in (0, 1)
//               to.real(name, double)                a finite number
//               to.stop(name, int)                   "A" or "B": upper_side or lower_side
//               to.rows("rows", row_list, most)      rows on (x, v, a): Python's `row`, several times
//               to.of_rows(name, const double*&, rows, least, most)   a number in a range for each row
//               to.velocities(row_list)              no option: a row for the velocity of each coordinate
//
// The declaration may also have
//
//     long long borrows() const                      how many elements of memory a member borrows
//     static long long tangents(const batch_sizes&)  how many tangent vectors are to be carried along
//     static constexpr bool of_any_end               results also where the window is incomplete
//
// Of the members of observer<Flow> only write() has to be there:
//
//     void prepare(const pauses&, const member_start<Flow>&)   options; called before a run
//     void on_event(const event_view<Flow>&)                   called at every event of the window
//     void on_flight(const flight_segment<Flow>&)              called for every flight of the window
//     void write(const auto& m, const pauses& to) const        put row m.row of the tables; m is a
//                                                              finished_member (ensemble/member.hpp)
//     element* memory                                          borrowed; `element` is a type
//     watched_rows<Flow> watched                               the rows, for every mode
//
// It keeps sums, not motions, and uses no heap, library or exceptions.
#pragma once

#include "vibroimpact/observe/event_view.hpp"
#include "vibroimpact/system/mode_coordinates.hpp"

namespace vi {

inline constexpr long long largest_count = 1000000; // of an option
inline constexpr long long no_limit = 0x7fffffff;

struct batch_sizes {
    long long systems, modes, members;
    long long degrees, lines, contacts, elements; // their numbers follow those of contacts
    long long mixed; // whether positions show q' of blocks in free flight
};

// Results: one row of numbers per member.
struct result_table {
    double* numbers = nullptr;
    long long width = 0;

    VI_HD double* row(long long member) const { return numbers + member * width; }
    template <class... Numbers>
    VI_HD void put(long long member, const Numbers&... values) const {
        long long place = member * width;
        ((numbers[place++] = static_cast<double>(values)), ...);
    }
};

// Rows on the positions, velocities and accelerations of the mechanism: 3 n numbers each.
struct row_list {
    const double* numbers = nullptr;
    long long count = 0;
};

// These rows on the coordinates of every mode, with their derivatives: those of mode m begin at m * stride.
template <class Flow>
struct watched_rows {
    const guard<double, Flow::max_dimension>* rows = nullptr;
    int count = 0;
    long long stride = 0;

    VI_HD const auto* of_mode(int m) const { return rows + m * stride; }
};

// Force of every element along its row, and the speed at which it works on the motion: relative to a stop that
// moves, or to a belt, and zero where it does no work. Rows on (y, 1) of every mode.
struct element_rows {
    const double* rows = nullptr;
    int elements = 0;
    long long length = 0; // of a row

    VI_HD const double* force(int mode, int element) const {
        return rows + 2 * (static_cast<long long>(mode) * elements + element) * length;
    }
    VI_HD const double* speed(int mode, int element) const { return force(mode, element) + length; }
};

namespace detail {

// Contacts and elements of a flow, at most.
template <class Flow>
inline constexpr int most_parts = Flow::max_contacts + Flow::shape_type::max_elements;

} // namespace detail

// A member before its run.
template <class Flow>
struct member_start {
    double settle, observe; // the window
    double omega, phase;    // of the first forcing line, at the start; 0 without forcing
    double step;            // of the flow
    mode_coordinates free;
    watched_rows<Flow> watched; // all rows of all observers
    element_rows elements;
    const double* damping; // C of the mechanism, row by row
};

} // namespace vi
