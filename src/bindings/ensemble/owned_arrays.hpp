// The arrays of a batch as the bindings own them: what Python gives.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "arrays.hpp"
#include "vibroimpact/ensemble/arrays.hpp"

namespace binding {

// A batch, and the numbers that its arrays point to.
struct owned_arrays {
    // Numbers that an array is to have next.
    struct part {
        const char* name;
        const double* vi::batch_arrays::* field;
        array from;
        std::size_t size;
    };
    vi::batch_arrays view{};

    // Refuse arrays of other sizes than they are to have.
    static void check_sizes(const std::vector<part>& parts) {
        for (const auto& p : parts)
            if (p.from.size() != p.size)
                throw std::invalid_argument(std::string(p.name) + " has " +
                                            std::to_string(p.from.size()) + " numbers; expected " +
                                            std::to_string(p.size) + ".");
    }

    // Copy them all, or none.
    void add(const std::vector<part>& parts) {
        check_sizes(parts);
        for (const auto& p : parts)
            view.*p.field = keep(p.from.data(), p.size);
    }
    // A copy that lives as long as this.
    const double* keep(const double* from, std::size_t size) {
        return numbers_.emplace_back(from, from + size).data();
    }

private:
    std::vector<std::vector<double>> numbers_;
};

} // namespace binding
