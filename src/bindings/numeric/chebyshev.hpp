// Zeros of Chebyshev series in [-1, 1].
//
// Method      The series is expanded anew on ever smaller parts of the interval, T_k(a x + b) being a sum of T_j,
//             until its first coefficient outweighs the others, which leaves no zero, or that of its derivative
//             does, which leaves one where the signs at the ends differ: Newton's method within a bracket finds
//             it. Signs at common ends of parts are shared, so that no zero is lost between them.       (1)
//             On a part of 2^-17 of the interval that is still undecided a minimum of the modulus is a double
//             zero, and is returned twice: a pair that has left the real line by less than that.        (2)
// Accuracy    rounding of the coefficients over the slope
// Reference   Boyd, Solving Transcendental Equations (2014), ch. 2-3
#pragma once

#include <vector>

namespace binding {

// Value of a series, by Clenshaw's recurrence.
double chebyshev_value(const double* c, int terms, double x);

// Series of a number of terms.
class chebyshev {
public:
    explicit chebyshev(int terms);

    // The coefficients of the polynomial with these values at nodes, the Chebyshev points from right to left.
    void fit(const double* values, double* coefficients) const;
    // Zeros, up to 1e-6 beyond the ends, in order; coefficients after the last one that is above `rounding` of the
    // largest are left out.
    void zeros(const double* c, double rounding, std::vector<double>& out) const;

private:
    struct part {
        double low, high; // ends
        double at_low, at_high;
        int depth;
    };
    using numbers = std::vector<double>;
    numbers moved(double scale, double shift) const;
    void expand(const numbers& to, const double* c, double* out) const;
    void search(const double* c, const part& at, double noise, numbers& out) const;

    int terms_;
    numbers fit_, whole_, left_, right_; // matrices
};

} // namespace binding
