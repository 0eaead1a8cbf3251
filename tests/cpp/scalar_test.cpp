// The scalar types: masks, lanes, derivative rules, operation counts. Prints what fails, returns 1.
#include <cstdio>
#include <initializer_list>

#include "vibroimpact/numeric/counting.hpp"
#include "vibroimpact/numeric/jet.hpp"
#include "vibroimpact/numeric/math.hpp"
#include "vibroimpact/numeric/mixed_jet.hpp"
#include "vibroimpact/numeric/pack.hpp"

namespace {

int failures = 0;

void check(bool holds, const char* statement, int line) {
    if (!holds) {
        std::fprintf(stderr, "scalar_test.cpp:%d: not true: %s\n", line, statement);
        ++failures;
    }
}
#define CHECK(statement) check((statement), #statement, __LINE__)

bool near(double x, double y, double ulps) {
    constexpr double epsilon = 2.220446049250313e-16;
    return vi::abs(x - y) <= ulps * epsilon * vi::abs(y);
}

template <int N>
vi::pack<N> ramp() {
    vi::pack<N> p{};
    for (int i = 0; i < N; ++i)
        set_lane(p, i, 0.7 * i - 1.1);
    return p;
}

template <int N>
void lanes_are_independent() {
    const vi::pack<N> p = ramp<N>();
    const vi::pack<N> q = 1.0 / (2.0 + p * p) - p;
    const auto below = p < q;
    int count = 0;
    for (int i = 0; i < N; ++i) {
        const double x = lane(p, i);
        const double y = 1.0 / (2.0 + x * x) - x;
        CHECK(lane(q, i) == y);
        CHECK(lane(below, i) == (x < y));
        CHECK(lane(!below, i) == !(x < y));
        CHECK(lane(select(below, p, q), i) == (x < y ? x : y));
        CHECK(lane(min(p, q), i) == vi::min(x, y));
        CHECK(lane(max(p, q), i) == vi::max(x, y));
        CHECK(lane(abs(p), i) == vi::abs(x));
        CHECK(lane(sqrt(abs(p)), i) == vi::sqrt(vi::abs(x)));
        CHECK(lane(-p, i) == -x);
        count += x < y;
    }
    CHECK(any(below) == (count > 0));
    CHECK(all(below) == (count == N));
    CHECK(all(below | !below) && !any(below & !below));
    CHECK(all(vi::pack_mask<N>(true)) && !any(vi::pack_mask<N>(false)));
}

// A mask with one lane set is neither none nor all, wherever the lane is.
template <int N>
void masks_see_every_lane() {
    for (int i = 0; i < N; ++i) {
        vi::pack_mask<N> mask(false);
        CHECK(!any(mask));
        set_lane(mask, i, true);
        CHECK(any(mask) && !all(mask) && all(mask | !mask));
    }
}

void zeros_keep_their_sign() {
    const vi::pack<2> minus_zero(-0.0);
    CHECK(vi::bits(lane(minus_zero, 1)) == vi::bits(-0.0));
    CHECK(vi::bits(vi::sincos(-0.0).s) == vi::bits(-0.0));
    CHECK(vi::bits(vi::floor(-0.0)) == vi::bits(-0.0));
    CHECK(vi::bits(vi::nearbyint(-0.3)) == vi::bits(-0.0));
    CHECK(vi::bits(value(2.0 - vi::jet<double, 1>(2.0))) == vi::bits(0.0));
}

// d f(x) = f'(x), with the slope written independently of the header.
template <class J>
void slopes_are_exact(double x) {
    const J t = J::variable(x, 0);
    const auto f = sincos(t);
    const double s = value(f.s), c = value(f.c), e = value(exp(t));
    CHECK(f.s.d[0] == c && f.c.d[0] == -s);
    CHECK(exp(t).d[0] == e);
    CHECK(near(log(t).d[0], 1.0 / x, 1.0));
    CHECK(near(sqrt(t).d[0], 0.5 / vi::sqrt(x), 1.0));
    CHECK(near((t * t * t).d[0], 3.0 * x * x, 2.0));
    CHECK(near((1.0 / t).d[0], -1.0 / (x * x), 2.0));
    CHECK(near((t / (1.0 + t)).d[0], 1.0 / ((1.0 + x) * (1.0 + x)), 8.0 * (1.0 + x)));
    CHECK((3 * t - 2.0).d[0] == 3.0 && (2.0 - t).d[0] == -1.0 && (t / 4.0).d[0] == 0.25);
    CHECK(abs(-t).d[0] == 1.0 && min(t, J(x + 1.0)).d[0] == 1.0 && max(t, J(x + 1.0)).d[0] == 0.0);
}

// Identities whose derivative is known: sin^2 + cos^2 = 1, exp(log x) = x, sqrt(x)^2 = x, and the
// angle of (r cos a, r sin a), which is a whatever r is.
void identities_hold_with_derivatives(double x) {
    using J = vi::jet<double, 2>;
    const J a = J::variable(x, 0), r = J::variable(1.7, 1);
    const auto f = sincos(a);
    CHECK(vi::abs((f.s * f.s + f.c * f.c).d[0]) <= 1e-16);
    CHECK(near(exp(log(a)).d[0], 1.0, 2.0));
    CHECK(near((sqrt(a) * sqrt(a)).d[0], 1.0, 2.0));
    const J angle = atan2(r * f.s, r * f.c);
    CHECK(near(angle.d[0], 1.0, 4.0) && vi::abs(angle.d[1]) <= 1e-16);
    J sum = a;
    sum += r;
    sum *= 2.0;
    sum -= a;
    sum /= 2.0;
    CHECK(sum.d[0] == 0.5 && sum.d[1] == 1.0);
}

// Each lane of a jet of packs is the jet of that lane.
void jets_of_packs_are_jets_in_lanes() {
    using P = vi::pack<4>;
    using J = vi::jet<P, 2>;
    const auto f = [](const auto& x, const auto& y) {
        using vi::atan2, vi::exp, vi::select, vi::sincos, vi::sqrt; // for double
        const auto w = sincos(x * y);
        return select(x < 0.0, atan2(y, x) * w.s, exp(-y) / (2.0 + w.c)) + sqrt(y) * 3.0;
    };
    const P x = ramp<4>(), y = 1.0 + x * x;
    const J packed = f(J::variable(x, 0), J::variable(y, 1));
    for (int i = 0; i < 4; ++i) {
        using L = vi::jet<double, 2>;
        const L single = f(L::variable(lane(x, i), 0), L::variable(lane(y, i), 1));
        const L seen = lane(packed, i);
        CHECK(seen.v == single.v && seen.d[0] == single.d[0] && seen.d[1] == single.d[1]);
        CHECK(seen.v == f(lane(x, i), lane(y, i)));
    }
    J changed = packed;
    set_lane(changed, 2, vi::jet<double, 2>::variable(5.0, 1));
    CHECK(lane(changed.v, 2) == 5.0 && lane(changed.d[1], 2) == 1.0);
    CHECK(lane(changed.v, 1) == lane(packed.v, 1));
}

template <int K>
bool all_near(const vi::mixed_jet<K>& x, const vi::mixed_jet<K>& y, double ulps) {
    double size = 0.0;
    for (double c : y.c)
        size = vi::max(size, vi::abs(c));
    bool holds = true;
    for (int s = 0; s < x.size; ++s)
        holds = holds && vi::abs(x.c[s] - y.c[s]) <= ulps * 2.220446049250313e-16 * size;
    return holds;
}

// Every coefficient of an identity between functions is an identity between derivatives.
void identities_hold_to_third_order(double at) {
    using J = vi::mixed_jet<3>;
    const J x = at + 0.7 * J::direction(0) - 1.3 * J::direction(1) + 0.4 * J::direction(2);
    const J y = x * x + J::direction(1);
    const auto wave = sincos(x);
    CHECK(all_near(wave.s * wave.s + wave.c * wave.c, J(1.0), 64.0));
    CHECK(all_near(exp(log(y)), y, 64.0));
    CHECK(all_near(sqrt(y) * sqrt(y), y, 64.0));
    CHECK(all_near(x / y * y, x, 256.0));
    CHECK((x / y).c[0] == x.c[0] / y.c[0]);
    CHECK(all_near(exp(x) * exp(-x), J(1.0), 256.0));
}

void mixed_jets_are_multilinear_forms() {
    using J = vi::mixed_jet<3>;
    const double u[] = {2.0, -1.0, 0.5}, v[] = {3.0, 1.0, -2.0}; // directions of x and y
    J x(1.5), y(-0.25);
    for (int i = 0; i < 3; ++i) {
        x = x + u[i] * J::direction(i);
        y = y + v[i] * J::direction(i);
    }
    const J f = x * x * y; // D f = 2 x y u + x^2 v, D^2 f = 2 y u u + 2 x (u v + v u), ...
    CHECK(f.c[1] == 2.0 * 1.5 * -0.25 * u[0] + 2.25 * v[0]);
    CHECK(f.c[3] == 2.0 * -0.25 * u[0] * u[1] + 3.0 * (u[0] * v[1] + v[0] * u[1]));
    CHECK(f.c[7] == 2.0 * (u[0] * u[1] * v[2] + u[0] * v[1] * u[2] + v[0] * u[1] * u[2]));
    CHECK(J::direction(0).c[1] == 1.0 && (J::direction(0) * J::direction(0)).c[1] == 0.0);
}

struct first_count {
    static inline vi::operation_counts counts;
};
struct second_count {
    static inline vi::operation_counts counts;
};

void operations_are_counted_by_tag() {
    using C = vi::counting<first_count>;
    const C x = 3.0, y = sqrt(x * x + 2.0 * x - 1.0) / x;
    CHECK(first_count::counts.multiplications == 2 && first_count::counts.additions == 2);
    CHECK(first_count::counts.divisions == 1 && first_count::counts.square_roots == 1);
    CHECK(y < x && first_count::counts.comparisons == 1);
    CHECK(first_count::counts.flops() == 6 && second_count::counts.flops() == 0);
    sincos(vi::counting<second_count>(0.5));
    CHECK(second_count::counts.flops() > 30 && first_count::counts.flops() == 6);
    second_count::counts = {};
    CHECK(second_count::counts.flops() == 0);
}

} // namespace

int main() {
    lanes_are_independent<2>();
    lanes_are_independent<4>();
    lanes_are_independent<8>();
    masks_see_every_lane<2>();
    masks_see_every_lane<4>();
    masks_see_every_lane<8>();
    zeros_keep_their_sign();
    for (double x : {0.3, 1.0, 2.9}) {
        slopes_are_exact<vi::jet<double, 1>>(x);
        slopes_are_exact<vi::jet<double, 3>>(x);
        identities_hold_with_derivatives(x);
        identities_hold_to_third_order(x);
    }
    mixed_jets_are_multilinear_forms();
    jets_of_packs_are_jets_in_lanes();
    operations_are_counted_by_tag();
    return failures != 0;
}
