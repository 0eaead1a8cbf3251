// The small linear complementarity problem behind impacts and sticking.
//
// Method      Find x >= 0 with w = b + A x >= 0 and x . w = 0, A symmetric positive definite, by
//             trying the sets of active contacts (x_i > 0) from the empty one on: for a set S,
//             A_SS x_S = -b_S by Gauss elimination, accepted if x_S >= 0 and w >= 0 outside S,
//             within the slack that is given: of sets that differ by ties the smallest is found.
// Assumes     at most max_contacts unknowns. Dependent contacts (two stops that hold the same coordinate)
//             make A singular: sets of them are passed over, as independent ones carry the same forces.
// Fails       returns -1 where no set is accepted
// Reference   Cottle, Pang, Stone, The Linear Complementarity Problem (1992), thm 3.3.7
#pragma once

#include "vibroimpact/system/guard.hpp"

namespace vi {

template <int N>
struct small_system {
    int n = 0;
    double a[N][N];
    double b[N];
    double slack[N]; // w_i is zero where it is above -slack_i
};

template <int N>
struct complementary {
    int active; // bit i set: unknown i is positive; -1: none found
    vec<double, N> x;
};

namespace detail {

// x_S from A_SS x_S = -b_S; zeros elsewhere. Positive definite: no pivoting needed. False where S is
// dependent: where what the others leave of an A_ii is rounding of it.
template <int N>
VI_HD inline bool solve_active(const small_system<N>& p, int set, vec<double, N>& x) {
    double m[N][N + 1] = {};
    int index[N] = {}, k = 0;
    for (int i = 0; i < p.n; ++i) {
        x[i] = 0.0;
        if (set >> i & 1) index[k++] = i;
    }
    for (int i = 0; i < k; ++i) {
        for (int j = 0; j < k; ++j)
            m[i][j] = p.a[index[i]][index[j]];
        m[i][k] = -p.b[index[i]];
    }
    for (int i = 0; i < k; ++i) {
        if (!(m[i][i] > 64.0 * unit_roundoff * p.a[index[i]][index[i]])) return false;
        for (int r = i + 1; r < k; ++r) {
            const double factor = m[r][i] / m[i][i];
            for (int j = i; j <= k; ++j)
                m[r][j] = m[r][j] - factor * m[i][j];
        }
    }
    for (int i = k - 1; i >= 0; --i) {
        double sum = m[i][k];
        for (int j = i + 1; j < k; ++j)
            sum = sum - m[i][j] * x[index[j]];
        x[index[i]] = sum / m[i][i];
    }
    return true;
}

// w_i.
template <int N>
VI_HD inline double left_over(const small_system<N>& p, int i, const vec<double, N>& x) {
    double w = p.b[i];
    for (int j = 0; j < p.n; ++j)
        w = w + p.a[i][j] * x[j];
    return w;
}

template <int N>
VI_HD inline bool accepted(const small_system<N>& p, int set, const vec<double, N>& x) {
    for (int i = 0; i < p.n; ++i) {
        if (set >> i & 1) {
            if (!(x[i] >= 0.0)) return false;
        } else if (!(left_over(p, i, x) >= -p.slack[i])) {
            return false;
        }
    }
    return true;
}

} // namespace detail

template <int N>
VI_CALL complementary<N> solve_complementarity(const small_system<N>& p) {
    complementary<N> out{};
    for (int set = 0; set < 1 << p.n; ++set)
        if (detail::solve_active(p, set, out.x) && detail::accepted(p, set, out.x)) {
            out.active = set;
            return out;
        }
    out.active = -1;
    return out;
}

} // namespace vi
