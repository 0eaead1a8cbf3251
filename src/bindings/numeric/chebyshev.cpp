#include "numeric/chebyshev.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vibroimpact/numeric/math.hpp"

namespace binding {

namespace {

constexpr double edge = 1e-6;      // zeros so far outside are kept
constexpr double middle = 0.04;    // where parts are cut: not at a point of symmetry
constexpr double outweighed = 1.1; // bounds |T_k| where a pair of (2) may be
constexpr int halvings = 18;
constexpr int most_steps = 60; // of Newton's method in a bracket; bisections alone take as many

double sum_of_moduli(const double* c, int from, int terms) {
    double sum = 0.0;
    for (int k = from; k < terms; ++k)
        sum += std::abs(c[k]);
    return sum;
}

// The zero of a series that is monotone between -1 and 1, with the sign that it has at -1.
double zero_of_monotone(const double* c, const double* slope, int terms, bool negative) {
    double low = -1.0, high = 1.0, x = 0.0;
    for (int step = 0; step < most_steps; ++step) {
        const double f = chebyshev_value(c, terms, x);
        ((f < 0.0) == negative ? low : high) = x;
        double next = x - f / chebyshev_value(slope, terms, x);
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        const bool found = std::abs(next - x) <= std::numeric_limits<double>::epsilon();
        x = next;
        if (found) break;
    }
    return x;
}

} // namespace

double chebyshev_value(const double* c, int terms, double x) {
    double b = 0.0, before = 0.0;
    for (int k = terms - 1; k > 0; --k) {
        const double next = c[k] + 2.0 * x * b - before;
        before = b;
        b = next;
    }
    return c[0] + x * b - before;
}

chebyshev::chebyshev(int terms)
    : terms_(terms), fit_(static_cast<std::size_t>(terms) * terms), whole_(moved(1.0 + edge, 0.0)),
      left_(moved(0.5 * (1.0 + middle), 0.5 * (middle - 1.0))),
      right_(moved(0.5 * (1.0 - middle), 0.5 * (1.0 + middle))) {
    for (int j = 0; j < terms; ++j)
        for (int k = 0; k < terms; ++k) {
            const double angle = vi::pi * ((k * (2 * j + 1)) % (4 * terms)) / (2.0 * terms);
            fit_[k * terms + j] = (k ? 2.0 : 1.0) / terms * vi::sincos(angle).c;
        }
}

// Matrix that gives the coefficients of f(scale x + shift) from those of f; zero below the diagonal.
chebyshev::numbers chebyshev::moved(double scale, double shift) const {
    numbers columns(static_cast<std::size_t>(terms_) *
                    terms_); // T_k(scale x + shift), one after the other
    for (int k = 0; k < terms_; ++k) {
        double* to = columns.data() + k * terms_;
        if (k == 0) {
            to[0] = 1.0;
            continue;
        }
        const double* last = to - terms_;
        const double factor = k == 1 ? 1.0 : 2.0;
        for (int j = 0; j < k; ++j) {
            to[j] += factor * shift * last[j];
            to[j + 1] += factor * scale * last[j] * (j ? 0.5 : 1.0);
            if (j) to[j - 1] += factor * scale * last[j] * 0.5;
        }
        for (int j = 0; j < k - 1; ++j)
            to[j] -= (last - terms_)[j];
    }
    return columns;
}

void chebyshev::expand(const numbers& to, const double* c, double* out) const {
    std::fill(out, out + terms_, 0.0);
    for (int k = 0; k < terms_; ++k)
        if (c[k] != 0.0)
            for (int j = 0; j <= k; ++j)
                out[j] += to[k * terms_ + j] * c[k];
}

void chebyshev::fit(const double* values, double* coefficients) const {
    for (int k = 0; k < terms_; ++k) {
        double sum = 0.0;
        for (int j = 0; j < terms_; ++j)
            sum += fit_[k * terms_ + j] * values[j];
        coefficients[k] = sum;
    }
}

void chebyshev::zeros(const double* c, double rounding, numbers& out) const {
    double largest = 0.0;
    for (int k = 0; k < terms_; ++k) {
        if (!std::isfinite(c[k])) return;
        largest = std::max(largest, std::abs(c[k]));
    }
    if (largest == 0.0) return;
    numbers kept(c, c + terms_), here(terms_);
    for (int k = terms_ - 1; k >= 0 && std::abs(kept[k]) <= rounding * largest; --k)
        kept[k] = 0.0;
    expand(whole_, kept.data(), here.data());
    const double ends[2] = {chebyshev_value(here.data(), terms_, -1.0),
                            chebyshev_value(here.data(), terms_, 1.0)};
    const double noise =
        std::numeric_limits<double>::epsilon() * sum_of_moduli(here.data(), 0, terms_);
    search(here.data(), {-1.0 - edge, 1.0 + edge, ends[0], ends[1], halvings}, noise, out);
}

void chebyshev::search(const double* c, const part& at, double noise, numbers& out) const {
    const double rest = sum_of_moduli(c, 1, terms_);
    const bool crosses = (at.at_low < 0.0) != (at.at_high < 0.0);
    if (!crosses && std::abs(c[0]) > outweighed * rest) return;
    const auto place = [&](double x) {
        return 0.5 * (at.low + at.high) + 0.5 * (at.high - at.low) * x;
    };
    if (rest + std::abs(c[0]) <= noise) { // zero to rounding
        if (crosses) out.push_back(place(0.0));
        return;
    }
    numbers slope(terms_ + 1);
    for (int k = terms_ - 1; k > 0; --k)
        slope[k - 1] = (k + 1 < terms_ ? slope[k + 1] : 0.0) + 2.0 * k * c[k];
    slope[0] *= 0.5;
    if (std::abs(slope[0]) >= sum_of_moduli(slope.data(), 1, terms_)) {
        if (crosses)
            out.push_back(place(zero_of_monotone(c, slope.data(), terms_, at.at_low < 0.0)));
        return;
    }
    if (at.depth == 0) { // (2)
        const double x = -slope[0] / slope[1];
        const double double_zero = std::clamp(x, -1.0, 1.0);
        const double value = chebyshev_value(c, terms_, double_zero);
        if (crosses || 2.0 * std::abs(value) <= std::abs(slope[1]))
            out.insert(out.end(), crosses ? 1 : 2, place(double_zero));
        return;
    }
    const double cut = place(middle), value = chebyshev_value(c, terms_, middle);
    numbers half(terms_);
    expand(left_, c, half.data());
    search(half.data(), {at.low, cut, at.at_low, value, at.depth - 1}, noise, out);
    expand(right_, c, half.data());
    search(half.data(), {cut, at.high, value, at.at_high, at.depth - 1}, noise, out);
}

} // namespace binding
