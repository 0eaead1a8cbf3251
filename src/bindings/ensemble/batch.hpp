// Running the members of a batch; one function, and one file, for each shape that is compiled.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "vibroimpact/ensemble/arrays.hpp"

namespace binding {

using interrupt_check = bool (*)(); // called now and then; true ends the run

// The numbers of one system at a time, of many of one structure: those that all share stand still,
// each other one is taken from the column that has it for every system.
class system_numbers {
public:
    using field = const double* vi::batch_arrays::*;
    using varied_places = std::vector<std::pair<std::size_t, const double*>>;

    // An array gets more numbers, behind those that it has. `varied`: their places, with columns.
    void add(field to, const double* from, std::size_t size, const varied_places& varied) {
        auto& array = array_of(to);
        const std::size_t first = array.numbers.size();
        array.numbers.insert(array.numbers.end(), from, from + size);
        for (const auto& [place, column] : varied)
            array.varied.push_back({first + place, column});
    }

    // Let a batch of one system borrow these arrays.
    void set_arrays(vi::batch_arrays& to) const {
        for (const auto& array : arrays_)
            to.*array.name = array.numbers.data();
    }

    // Become those of system s.
    void become(long long s) {
        for (auto& array : arrays_)
            for (const auto& one : array.varied)
                array.numbers[one.place] = one.column[s];
    }

private:
    struct varied_number {
        std::size_t place;
        const double* column;
    };
    struct numbers_of_field {
        field name;
        std::vector<double> numbers;
        std::vector<varied_number> varied;
    };

    numbers_of_field& array_of(field name) {
        for (auto& array : arrays_)
            if (array.name == name) return array;
        return arrays_.emplace_back(numbers_of_field{name, {}, {}});
    }

    std::vector<numbers_of_field> arrays_;
};

// Members to be run. The arrays hold one system, of which every member is, in turn.
struct batch_run {
    const system_numbers& numbers;
    const vi::batch_arrays& arrays;
    const int* system; // of each member
};

void run_modal_small(const batch_run& b, interrupt_check interrupted);
void run_modal_small_mixed(const batch_run& b, interrupt_check interrupted);
void run_modal(const batch_run& b, interrupt_check interrupted);
void run_dense_small(const batch_run& b, interrupt_check interrupted);
void run_dense(const batch_run& b, interrupt_check interrupted);

} // namespace binding
