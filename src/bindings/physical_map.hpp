// Physical coordinates of every mode: (x, v) from y and back.
#pragma once

#include <utility>

#include "system.hpp"
#include "vibroimpact/hybrid.hpp"

namespace binding {

// What add_mode was told of one mode; row-major, see coordinates.py.
struct physical_map {
    numbers to_x, to_v, offset, from_x, from_v, particular;
};

inline double entry(const numbers& matrix, int i, int j, int columns) {
    return matrix[static_cast<std::size_t>(i) * columns + j];
}

template <int D>
class physical_maps {
public:
    using map_type = vi::coordinate_map<D>;

    physical_maps(int n, int degrees, numbers kappas)
        : n_(n), degrees_(degrees), lines_(static_cast<int>(kappas.size())),
          kappas_(std::move(kappas)) {}

    void add(physical_map map) { maps_.push_back(std::move(map)); }
    const physical_map& operator[](int mode) const { return maps_[static_cast<std::size_t>(mode)]; }

    // Row i of a (rows, n) matrix times y.
    template <class T>
    T row_times(const numbers& matrix, int i, const vi::vec<T, D>& y) const {
        T sum = entry(matrix, i, 0, n_) * y[0];
        for (int j = 1; j < n_; ++j)
            sum = sum + entry(matrix, i, j, n_) * y[j];
        return sum;
    }

    // x, then v.
    void append(numbers& out, int mode, const vi::vec<double, D>& y) const {
        const auto& p = (*this)[mode];
        for (int i = 0; i < degrees_; ++i)
            out.push_back(row_times(p.to_x, i, y) + p.offset[i]);
        for (int i = 0; i < degrees_; ++i)
            out.push_back(row_times(p.to_v, i, y));
    }

    // sin and cos of a forcing line.
    template <class T>
    T sine(const vi::vec<T, D>& y, int line) const {
        return y[n_ - 2 * lines_ + 2 * line];
    }
    template <class T>
    T cosine(const vi::vec<T, D>& y, int line) const {
        return y[n_ - 2 * lines_ + 2 * line + 1] / kappas_[line];
    }

    // Phase of a forcing line in [0, 2 pi).
    double phase(const vi::vec<double, D>& y, int line) const {
        const double angle = vi::atan2(sine(y, line), cosine(y, line));
        return angle < 0.0 ? angle + 2.0 * vi::pi : angle;
    }

    // Free coordinates of (x, v, sin and cos of the lines).
    template <class T>
    vi::vec<T, D> free_from(const T* x, const T* v, const T* waves) const {
        const auto& p = maps_[0];
        vi::vec<T, D> y{};
        for (int i = 0; i < n_; ++i) {
            T sum = T(0.0);
            for (int k = 0; k < degrees_; ++k)
                sum = sum + entry(p.from_x, i, k, degrees_) * (x[k] - p.offset[k]) +
                      entry(p.from_v, i, k, degrees_) * v[k];
            for (int l = 0; l < lines_; ++l)
                sum =
                    sum + entry(p.particular, i, 2 * l, 2 * lines_) * waves[2 * l] +
                    entry(p.particular, i, 2 * l + 1, 2 * lines_) * (kappas_[l] * waves[2 * l + 1]);
            y[i] = sum;
        }
        for (int l = 0; l < lines_; ++l) {
            y[n_ - 2 * lines_ + 2 * l] = waves[2 * l];
            y[n_ - 2 * lines_ + 2 * l + 1] = kappas_[l] * waves[2 * l + 1];
        }
        return y;
    }

    // The map y_a -> y_b through physical coordinates; forcing pairs pass unchanged.
    map_type between(int a, int b) const {
        const auto &pa = (*this)[a], &pb = (*this)[b];
        map_type out{};
        const int first_line = n_ - 2 * lines_;
        for (int i = 0; i < first_line; ++i) {
            for (int k = 0; k < degrees_; ++k) {
                const double x = entry(pb.from_x, i, k, degrees_);
                const double v = entry(pb.from_v, i, k, degrees_);
                for (int j = 0; j < n_; ++j)
                    out.matrix[i][j] += x * entry(pa.to_x, k, j, n_) + v * entry(pa.to_v, k, j, n_);
                out.shift[i] += x * (pa.offset[k] - pb.offset[k]);
            }
            for (int l = 0; l < 2 * lines_; ++l)
                out.matrix[i][first_line + l] += entry(pb.particular, i, l, 2 * lines_);
        }
        for (int l = first_line; l < n_; ++l)
            out.matrix[l][l] = 1.0;
        return out;
    }

private:
    int n_, degrees_, lines_;
    numbers kappas_;
    std::vector<physical_map> maps_;
};

} // namespace binding
