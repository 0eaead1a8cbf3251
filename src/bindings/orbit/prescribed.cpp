#include "orbit/prescribed.hpp"

#include <algorithm>

#include "vibroimpact/numeric/jet.hpp"
#include "vibroimpact/numeric/mixed_jet.hpp"

namespace binding {

namespace {

using shape = vi::any_size;
inline constexpr int block = 6; // directions carried at once by first-order jets

template <class R>
using kernel = vi::prescribed<R, shape>;

// A parameter p + dp, as the jets R carry it.
template <class R>
struct expansion {
    R dp;
    R operator()(const double* f, std::size_t stride) const {
        if constexpr (vi::is_same<R, double>) {
            return f[0];
        } else {
            R sum = f[3 * stride];
            sum = f[2 * stride] + sum * dp * (1.0 / 3.0);
            sum = f[stride] + sum * dp * 0.5;
            return f[0] + sum * dp;
        }
    }
};

template <class R>
void fill(R* out, const numbers& from, const expansion<R>& at) {
    const std::size_t n = from.size() / parameter_orders;
    for (std::size_t i = 0; i < n; ++i)
        out[i] = at(from.data() + i, n);
}

template <class R>
vi::stop<R, shape::max_dimension> stop_of(const prescribed_data::stop& from,
                                          const expansion<R>& at) {
    vi::stop<R, shape::max_dimension> s{};
    fill(s.row.x, from.row, at);
    fill(&s.limit, from.limit, at);
    fill(s.impulse.x, from.impulse, at);
    fill(&s.restitution, from.restitution, at);
    fill(s.kick.x, from.kick, at);
    s.chatters = from.chatters;
    return s;
}

template <class R>
void fill_field(kernel<R>& k, const prescribed_data::mode& from, const expansion<R>& at) {
    k.field.step = from.step;
    fill(k.field.constant.x, from.constant, at);
    const auto width = static_cast<std::ptrdiff_t>(k.field.dimension_);
    numbers row(parameter_orders * static_cast<std::size_t>(width));
    for (std::ptrdiff_t i = 0; i < width; ++i) {
        for (int order = 0; order < parameter_orders; ++order)
            std::copy_n(from.field.begin() + (order * width + i) * width, width,
                        row.begin() + order * width);
        fill(k.field.b[i].x, row, at);
    }
}

template <class R>
void fill_kernel(kernel<R>& k, const prescribed_data& d, std::size_t mode, const expansion<R>& at) {
    k.field.dimension_ = d.dimension;
    k.degrees = d.degrees;
    k.lines = static_cast<int>(d.ratios.size());
    k.rate = d.rate;
    std::copy(d.ratios.begin(), d.ratios.end(), k.ratio);
    fill(&k.omega, d.omega, at);
    fill_field(k, d.modes[mode], at);
}

// Every mode; matrices of jets are large: on the heap.
template <class R>
std::vector<kernel<R>> kernels_of(const prescribed_data& d, const expansion<R>& at) {
    std::vector<kernel<R>> out(d.modes.size());
    for (std::size_t m = 0; m < out.size(); ++m)
        fill_kernel(out[m], d, m, at);
    return out;
}

template <class T>
vi::orbit_state<T> state_at(const segments& s, int segment, int size) {
    vi::orbit_state<T> z{};
    for (int i = 0; i < size; ++i)
        z[i] = T(s.states[static_cast<std::size_t>(segment) * size + i]);
    return z;
}

void append(numbers& to, const vi::orbit_state<double>& z, int size) {
    to.insert(to.end(), z.x, z.x + size);
}

// Columns [first, first + N) of the derivatives of one segment, from jets that carry them.
template <int N>
void write_columns(linearised& out, const vi::arrival<vi::jet<double, N>>& a, int segment, int size,
                   int first, int count) {
    const auto width = static_cast<std::size_t>(size) + 2;
    for (int j = 0; j < count; ++j) {
        for (int i = 0; i < size; ++i)
            out.after_by[(static_cast<std::size_t>(segment) * size + i) * width + first + j] =
                a.after[i].d[j];
        out.gap_by[segment * width + first + j] = a.gap.d[j];
    }
}

// By the state and the time: B is constant.
void by_state(const kernel<double>& k, const segments& s, int segment, int size, linearised& out,
              const vi::stop<double, shape::max_dimension>& at,
              const typename kernel<double>::field_type::propagator& e) {
    using jet = vi::jet<double, block>;
    const double t = s.durations[segment];
    for (int first = 0; first <= size; first += block) {
        const int count = std::min(block, size + 1 - first);
        auto z = state_at<jet>(s, segment, size);
        jet dt(0.0);
        for (int j = 0; j < count; ++j)
            (first + j < size ? z[first + j] : dt).d[j] = 1.0;
        write_columns<block>(out, k.fly<1>(at, z, e, t, dt), segment, size, first, count);
    }
}

template <int K>
vi::mixed_jet<K> seeded(double x, const numbers& directions, int column, int width) {
    vi::mixed_jet<K> z(x);
    for (int i = 0; i < K; ++i)
        z.c[1 << i] = directions[static_cast<std::size_t>(i) * width + column];
    return z;
}

// Second derivatives of one segment by the direction of e_1 and the number that e_2 moves.
template <class R>
vi::arrival<vi::mixed_jet<2>>
both_moved(const kernel<R>& k, const vi::stop<R, shape::max_dimension>& at,
           const typename kernel<R>::field_type::propagator& e, const segments& s, int segment,
           const double* along, int moved) {
    using jet = vi::mixed_jet<2>;
    const int size = 2 * k.degrees + 1;
    auto z = state_at<jet>(s, segment, size);
    jet dt(0.0);
    for (int i = 0; i < size; ++i)
        z[i].c[1] = along[i];
    dt.c[1] = along[size];
    if (moved <= size) (moved < size ? z[moved] : dt).c[2] = 1.0;
    return k.template fly<2>(at, z, e, R(s.durations[segment]), dt);
}

// The map over all segments.
template <class R, int K>
numbers map_forms(const prescribed_data& d, const segments& s, const ends& e,
                  const expansion<R>& at, const numbers& directions) {
    using T = vi::mixed_jet<K>;
    const int size = 2 * d.degrees + 1, count = static_cast<int>(s.durations.size());
    const auto modes = kernels_of<R>(d, at);
    vi::orbit_state<T> z{};
    for (int i = 0; i < size; ++i)
        z[i] = seeded<K>(s.states[i], directions, i, size + 1);
    if (e.stop >= 0) modes[0].put_on(stop_of(d.stops[e.stop], at), z, e.solved);
    T elapsed(0.0);
    for (int segment = 0; segment < count; ++segment) {
        const double t = s.durations[segment];
        if (segment > 0) { // values stay on the orbit, whose instability would carry them off
            const auto known = state_at<double>(s, segment, size);
            for (int i = 0; i < size; ++i)
                z[i].c[0] = known[i];
        }
        if (s.stops[segment] >= 0) {
            const auto& stop = d.stops[s.stops[segment]];
            elapsed = elapsed + modes[stop.mode].template impact<K>(stop_of(stop, at), z, t);
        } else {
            R period(0.0);
            fill(&period, e.period, at);
            const T dt = (T(0.0) + period) - elapsed;
            modes[e.mode].template coast<K>(z, t, dt - vi::value(dt));
            elapsed = T(0.0) + period;
        }
    }
    numbers out;
    for (int subset = 0; subset < T::size; ++subset) {
        for (int i = 0; i < size; ++i)
            out.push_back(z[i].c[subset]);
        out.push_back(elapsed.c[subset]);
    }
    return out;
}

template <int K>
numbers forms_of_order(const prescribed_data& d, const segments& s, const ends& e,
                       const numbers& directions) {
    const int width = 2 * d.degrees + 2;
    const auto dp = seeded<K>(0.0, directions, width - 1, width);
    const bool fixed = std::all_of(dp.c, dp.c + dp.size, [](double x) { return x == 0.0; });
    return fixed ? map_forms<double, K>(d, s, e, {0.0}, directions)
                 : map_forms<vi::mixed_jet<K>, K>(d, s, e, {dp}, directions);
}

} // namespace

linearised prescribed::linearise(const segments& s) const {
    using dual = vi::jet<double, 1>;
    const int size = 2 * data_.degrees + 1, count = static_cast<int>(s.durations.size());
    const auto width = static_cast<std::size_t>(size) + 2;
    const expansion<double> fixed{0.0};
    const expansion<dual> moving{dual::variable(0.0, 0)};
    const auto modes = kernels_of(data_, fixed);
    const auto varied_modes = kernels_of(data_, moving);
    linearised out;
    out.after_by.resize(static_cast<std::size_t>(count) * size * width);
    out.gap_by.resize(count * width);
    for (int segment = 0; segment < count; ++segment) {
        const auto& stop = data_.stops[s.stops[segment]];
        const auto& k = modes[stop.mode];
        const auto& varied = varied_modes[stop.mode];
        const auto here = stop_of(stop, fixed);
        const double t = s.durations[segment];
        const auto e = k.field.at_time(t);
        const auto a = k.fly<1>(here, state_at<double>(s, segment, size), e, t, 0.0);
        append(out.after, a.after, size);
        append(out.before, a.before, size);
        out.gap.push_back(a.gap);
        out.rate.push_back(a.rate);
        out.rate_after.push_back(a.rate_after);
        by_state(k, s, segment, size, out, here, e);
        const auto by_parameter =
            varied.fly<1>(stop_of(stop, moving), state_at<dual>(s, segment, size),
                          varied.field.at_time(dual(t)), dual(t), dual(0.0));
        write_columns<1>(out, by_parameter, segment, size, size + 1, 1);
    }
    return out;
}

second_order prescribed::second(const segments& s, const numbers& directions) const {
    using jet = vi::mixed_jet<2>;
    const int size = 2 * data_.degrees + 1, count = static_cast<int>(s.durations.size());
    const auto width = static_cast<std::size_t>(size) + 2;
    const expansion<double> fixed{0.0};
    const expansion<jet> moving{jet::direction(1)};
    const auto modes = kernels_of(data_, fixed);
    const auto varied_modes = kernels_of(data_, moving);
    second_order out{numbers(count * size * width), numbers(count * width)};
    for (int segment = 0; segment < count; ++segment) {
        const auto& stop = data_.stops[s.stops[segment]];
        const auto& k = modes[stop.mode];
        const auto& varied = varied_modes[stop.mode];
        const double* along = directions.data() + segment * (width - 1);
        const auto here = stop_of(stop, fixed);
        const auto e = k.field.at_time(s.durations[segment]);
        for (int j = 0; j < size + 2; ++j) {
            const auto a = j <= size ? both_moved(k, here, e, s, segment, along, j)
                                     : both_moved(varied, stop_of(stop, moving),
                                                  varied.field.at_time(jet(s.durations[segment])),
                                                  s, segment, along, j);
            for (int i = 0; i < size; ++i)
                out.after_by[(static_cast<std::size_t>(segment) * size + i) * width + j] =
                    a.after[i].c[3];
            out.gap_by[segment * width + j] = a.gap.c[3];
        }
    }
    return out;
}

numbers prescribed::forms(const segments& s, const ends& e, const numbers& directions,
                          int count) const {
    if (count == 1) return forms_of_order<1>(data_, s, e, directions);
    if (count == 2) return forms_of_order<2>(data_, s, e, directions);
    return forms_of_order<3>(data_, s, e, directions);
}

chatter_flights prescribed::chatter(const numbers& state, const numbers& direction,
                                    int stop) const {
    using dual = vi::jet<double, 1>;
    const int size = 2 * data_.degrees + 1;
    dual p(0.0);
    p.d[0] = direction[size];
    const expansion<dual> moving{p};
    const auto& at = data_.stops[stop];
    const auto own = std::make_unique<kernel<dual>>(); // of the one mode
    kernel<dual>& k = *own;
    fill_kernel(k, data_, static_cast<std::size_t>(at.mode), moving);
    auto z = state_at<dual>({state, {}, {}}, 0, size);
    for (int i = 0; i < size; ++i)
        z[i].d[0] = direction[i];
    chatter_flights out;
    dual theta = z[size - 1];
    auto y = k.embed(z);
    k.chatter(stop_of(at, moving), y, [&](const auto& begun, const dual& t) {
        const auto here = k.read(begun, theta);
        for (int i = 0; i < size; ++i) {
            out.states.push_back(here[i].v);
            out.states_by.push_back(here[i].d[0]);
        }
        out.durations.push_back(t.v);
        out.durations_by.push_back(t.d[0]);
        theta = theta + t * k.omega;
    });
    return out;
}

numbers prescribed::fly(const numbers& states, const std::vector<int>& modes,
                        const std::vector<int>& windows, const numbers& nodes,
                        double window) const {
    const auto kernels = kernels_of<double>(data_, {0.0});
    const int size = 2 * data_.degrees + 1;
    using propagator = typename kernel<double>::field_type::propagator;
    std::vector<std::vector<propagator>> to_node(kernels.size()); // last: a whole window
    for (std::size_t m = 0; m < kernels.size(); ++m) {
        if (std::find(modes.begin(), modes.end(), static_cast<int>(m)) == modes.end()) continue;
        for (double t : nodes)
            to_node[m].push_back(kernels[m].field.at_time(t));
        to_node[m].push_back(kernels[m].field.at_time(window));
    }
    numbers out;
    for (std::size_t segment = 0; segment < windows.size(); ++segment) {
        const auto& k = kernels[modes[segment]];
        const auto& p = to_node[modes[segment]];
        auto y = k.embed(state_at<double>({states, {}, {}}, static_cast<int>(segment), size));
        for (int w = 0; w < windows[segment]; ++w) {
            for (std::size_t node = 0; node < nodes.size(); ++node)
                append(out, k.read(k.field.apply(p[node], y), 0.0), size - 1);
            y = k.field.apply(p.back(), y);
        }
    }
    return out;
}

} // namespace binding
