// Linear systems and null spaces by elimination with complete pivoting.
//
// Method      Rows are scaled by powers of two to the order of one. P A Q = L U, the largest entry that
//             is left being the next pivot: it reveals the rank.
// Accuracy    backward stable
// Reference   Golub, Van Loan, Matrix Computations (2013), section 3.4.8
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace vi {

using column = std::vector<double>;

// A square matrix, row-major.
class square_matrix {
public:
    explicit square_matrix(std::size_t n) : n_(n), entries_(n * n) {}
    std::size_t size() const { return n_; }
    double& operator()(std::size_t i, std::size_t j) { return entries_[i * n_ + j]; }
    double operator()(std::size_t i, std::size_t j) const { return entries_[i * n_ + j]; }

private:
    std::size_t n_;
    column entries_;
};

inline column operator*(const square_matrix& a, const column& x) {
    column out(a.size());
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t j = 0; j < a.size(); ++j)
            out[i] += a(i, j) * x[j];
    return out;
}

// A power of two that is next to x > 0.
inline double power_near(double x) {
    int exponent = 0;
    std::frexp(x, &exponent);
    return std::ldexp(1.0, exponent);
}

class elimination {
public:
    explicit elimination(const square_matrix& a)
        : u_(a), scales_(a.size()), rows_(a.size()), columns_(a.size()) {
        const std::size_t n = u_.size();
        for (std::size_t i = 0; i < n; ++i) {
            rows_[i] = columns_[i] = i;
            scale(i);
        }
        for (std::size_t step = 0; step < n; ++step) {
            bring_largest(step);
            if (u_(step, step) == 0.0) return;
            for (std::size_t i = step + 1; i < n; ++i)
                eliminate(step, i);
        }
    }

    // Dimensions of the null space: pivots that are rounding beside the first.
    std::size_t null_dimensions() const {
        std::size_t count = 0;
        for (std::size_t i = 0; i < u_.size(); ++i)
            count += !(std::abs(u_(i, i)) > 0x1p-42 * std::abs(u_(0, 0)));
        return count;
    }

    column solve(const column& b) const {
        const std::size_t n = u_.size();
        column x(n);
        for (std::size_t i = 0; i < n; ++i) {
            x[i] = b[rows_[i]] * scales_[rows_[i]];
            for (std::size_t j = 0; j < i; ++j)
                x[i] -= u_(i, j) * x[j];
        }
        return back(std::move(x), n);
    }

    // Vector i of a basis of the null space, which has so many dimensions.
    column null_vector(std::size_t i, std::size_t dimensions) const {
        const std::size_t n = u_.size(), rank = n - dimensions;
        column x(n);
        x[rank + i] = 1.0;
        for (std::size_t j = 0; j < rank; ++j)
            x[j] = -u_(j, rank + i);
        return back(std::move(x), rank);
    }

private:
    void scale(std::size_t i) {
        double largest = 0.0;
        for (std::size_t j = 0; j < u_.size(); ++j)
            largest = std::max(largest, std::abs(u_(i, j)));
        scales_[i] = largest > 0.0 ? 1.0 / power_near(largest) : 1.0;
        for (std::size_t j = 0; j < u_.size(); ++j)
            u_(i, j) *= scales_[i];
    }
    void bring_largest(std::size_t step) {
        std::size_t row = step, to = step;
        for (std::size_t i = step; i < u_.size(); ++i)
            for (std::size_t j = step; j < u_.size(); ++j)
                if (std::abs(u_(i, j)) > std::abs(u_(row, to))) row = i, to = j;
        for (std::size_t j = 0; j < u_.size(); ++j)
            std::swap(u_(step, j), u_(row, j));
        for (std::size_t i = 0; i < u_.size(); ++i)
            std::swap(u_(i, step), u_(i, to));
        std::swap(rows_[step], rows_[row]);
        std::swap(columns_[step], columns_[to]);
    }
    void eliminate(std::size_t step, std::size_t i) {
        u_(i, step) /= u_(step, step);
        for (std::size_t j = step + 1; j < u_.size(); ++j)
            u_(i, j) -= u_(i, step) * u_(step, j);
    }
    // U^-1 x of the first `rank` rows, in the order of the columns of A.
    column back(column x, std::size_t rank) const {
        for (std::size_t i = rank; i-- > 0;) {
            for (std::size_t j = i + 1; j < rank; ++j)
                x[i] -= u_(i, j) * x[j];
            x[i] /= u_(i, i);
        }
        column out(x.size());
        for (std::size_t i = 0; i < x.size(); ++i)
            out[columns_[i]] = x[i];
        return out;
    }

    square_matrix u_; // below its diagonal, L
    column scales_;   // of rows of A
    std::vector<std::size_t> rows_, columns_;
};

// The solution of A x + B y = b, C^T x = 0, both parts: `columns` are those of B, `rows` those of C.
inline column solve_bordered(const square_matrix& a, const std::vector<column>& columns,
                             const std::vector<column>& rows, column b) {
    const std::size_t n = a.size();
    square_matrix bordered(n + columns.size());
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j)
            bordered(i, j) = a(i, j);
        for (std::size_t j = 0; j < columns.size(); ++j) {
            bordered(i, n + j) = columns[j][i];
            bordered(n + j, i) = rows[j][i];
        }
    }
    b.resize(bordered.size());
    return elimination(bordered).solve(b);
}

} // namespace vi
