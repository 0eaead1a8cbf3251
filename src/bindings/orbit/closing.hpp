// What closes an orbit: its equations, and the pencil of its multipliers, from the derivatives of its segments.
//
// Method      The unknowns z are of each segment the entries of the state that are kept, then its flight time.
//             Equations (1)-(4) of orbits/problem.py, but for what is held in every mode, and their derivatives by z
//             and by the parameter; matrix (2) of orbits/multipliers.py by products along the segments.
// Assumes     arrays of the shapes that Prescribed.linearise gives
// Accuracy    rounding of the sums
// Reference   theory.md, "Periodic orbits"
#pragma once

#include <utility>

#include "orbit/prescribed.hpp"

namespace binding {

struct closing_data {
    int entries;             // of a state (x, v, theta), 2n + 1
    int segments;            // that are solved for
    std::vector<int> kept;   // entries of a state that are unknowns
    std::vector<int> source; // of the image under the symmetry, by unknowns of a state
    numbers signs, turn;     // of that image
    numbers relative;        // matrix that takes out what drifts, by unknowns of a state
    std::vector<int> pivots; // unknowns by which drifts are measured
};

// Segments with their derivatives, as views of arrays.
struct segment_ends {
    const double *after, *gap, *after_by, *gap_by;
};

class closing {
public:
    explicit closing(closing_data data) : data_(std::move(data)) {}
    const closing_data& data() const { return data_; }
    std::size_t unknowns() const { return rows() * count(); }

    // States (count, entries) and flight times (count,) of the unknowns; zero where a state has no unknown.
    std::pair<numbers, numbers> unpacked(const double* z) const;
    // Left sides (d,), and their derivatives by z and, last, by the parameter (d, d + 1).
    std::pair<numbers, numbers> equations(const double* z, const segment_ends& s) const;
    // Matrix (2), (free + count, free + count), of tangents (unknowns of a state, free) in the section, of whose
    // coordinates `chosen` are the numbers; divided by the sizes of its rows, times those of its columns.
    numbers pencil(const segment_ends& s, const double* tangents, const std::vector<int>& chosen,
                   const double* row_sizes, const double* column_sizes) const;

private:
    std::size_t width() const { return data_.kept.size(); }
    std::size_t rows() const { return width() + 1; } // unknowns of a segment
    std::size_t count() const { return static_cast<std::size_t>(data_.segments); }
    // Entry of the derivatives of a segment by the unknown j, or, for the last j, by the parameter.
    std::size_t column(std::size_t j) const {
        return j < width() ? static_cast<std::size_t>(data_.kept[j])
                           : static_cast<std::size_t>(data_.entries) + (j - width());
    }
    const double* of_state(const segment_ends& s, std::size_t segment, std::size_t i) const {
        const auto entries = static_cast<std::size_t>(data_.entries);
        return s.after_by + (segment * entries + data_.kept[i]) * (entries + 2);
    }
    const double* of_gap(const segment_ends& s, std::size_t segment) const {
        return s.gap_by + segment * (data_.entries + 2);
    }
    // The rows of a block, those of a state, without what drifts.
    void without_drift(double* block, std::size_t columns, std::size_t stride) const;

    closing_data data_;
};

} // namespace binding
