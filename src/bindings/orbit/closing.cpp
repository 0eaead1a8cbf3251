#include "orbit/closing.hpp"

namespace binding {

std::pair<numbers, numbers> closing::unpacked(const double* z) const {
    const auto entries = static_cast<std::size_t>(data_.entries);
    numbers states(count() * entries), durations(count());
    for (std::size_t k = 0; k < count(); ++k) {
        const double* own = z + k * rows();
        for (std::size_t i = 0; i < width(); ++i)
            states[k * entries + data_.kept[i]] = own[i];
        durations[k] = own[width()];
    }
    return {std::move(states), std::move(durations)};
}

void closing::without_drift(double* block, std::size_t columns, std::size_t stride) const {
    const std::size_t q = width();
    numbers moved(q * columns);
    for (std::size_t i = 0; i < q; ++i)
        for (std::size_t m = 0; m < q; ++m) {
            const double factor = data_.relative[i * q + m];
            if (factor == 0.0) continue;
            for (std::size_t j = 0; j < columns; ++j)
                moved[i * columns + j] += factor * block[m * stride + j];
        }
    for (std::size_t i = 0; i < q; ++i)
        for (std::size_t j = 0; j < columns; ++j)
            block[i * stride + j] = moved[i * columns + j];
}

std::pair<numbers, numbers> closing::equations(const double* z, const segment_ends& s) const {
    const std::size_t q = width(), d = unknowns(), entries = data_.entries;
    numbers left(d), by(d * (d + 1));
    for (std::size_t k = 0; k < count(); ++k) {
        const bool last = k + 1 == count();
        const double* next = z + (last ? 0 : (k + 1) * rows());
        double *own = left.data() + k * rows(), *matrix = by.data() + k * rows() * (d + 1);
        const auto write = [&](double* row, const double* derivatives) {
            for (std::size_t j = 0; j <= q; ++j)
                row[k * rows() + j] = derivatives[column(j)];
            row[d] = derivatives[column(q + 1)];
        };
        for (std::size_t i = 0; i < q; ++i) {
            const double reached = s.after[k * entries + data_.kept[i]];
            double* row = matrix + i * (d + 1);
            write(row, of_state(s, k, i));
            if (last) {
                own[i] = reached - (data_.signs[i] * next[data_.source[i]] + data_.turn[i]);
                row[data_.source[i]] -= data_.signs[i];
            } else {
                own[i] = reached - next[i];
                row[(k + 1) * rows() + i] -= 1.0;
            }
        }
        own[q] = s.gap[k];
        write(matrix + q * (d + 1), of_gap(s, k));
        if (last && !data_.pivots.empty()) {
            without_drift(own, 1, 1);
            without_drift(matrix, d + 1, d + 1);
            for (int pivot : data_.pivots) {
                own[pivot] = z[pivot];
                matrix[pivot * (d + 1) + pivot] = 1.0;
            }
        }
    }
    return {std::move(left), std::move(by)};
}

numbers closing::pencil(const segment_ends& s, const double* tangents,
                        const std::vector<int>& chosen, const double* row_sizes,
                        const double* column_sizes) const {
    const std::size_t q = width(), free = chosen.size(), whole = free + count();
    numbers tangent(q * whole), moved(q * whole), out(whole * whole);
    for (std::size_t i = 0; i < q; ++i)
        for (std::size_t j = 0; j < free; ++j)
            tangent[i * whole + j] = tangents[i * free + j];
    // What derivatives by the state make of the tangents, into a row.
    const auto carry = [&](double* row, const double* derivatives, std::size_t known) {
        for (std::size_t m = 0; m < q; ++m) {
            const double factor = derivatives[data_.kept[m]];
            for (std::size_t j = 0; j < known; ++j)
                row[j] += factor * tangent[m * whole + j];
        }
    };
    for (std::size_t k = 0; k < count(); ++k) {
        const std::size_t known = free + k;
        double* gap = out.data() + known * whole;
        carry(gap, of_gap(s, k), known);
        gap[known] += of_gap(s, k)[column(q)];
        std::fill(moved.begin(), moved.end(), 0.0);
        for (std::size_t i = 0; i < q; ++i) {
            carry(moved.data() + i * whole, of_state(s, k, i), known);
            moved[i * whole + known] = of_state(s, k, i)[column(q)];
        }
        tangent.swap(moved);
    }
    if (!data_.pivots.empty()) without_drift(tangent.data(), whole, whole);
    for (std::size_t i = 0; i < free; ++i) {
        const std::size_t at = static_cast<std::size_t>(chosen[i]);
        for (std::size_t j = 0; j < whole; ++j)
            out[i * whole + j] = data_.signs[at] * tangent[data_.source[at] * whole + j];
    }
    for (std::size_t i = 0; i < whole; ++i)
        for (std::size_t j = 0; j < whole; ++j)
            out[i * whole + j] = out[i * whole + j] / row_sizes[i] * column_sizes[j];
    return out;
}

} // namespace binding
