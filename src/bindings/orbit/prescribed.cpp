#include "orbit/prescribed.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "numeric/chebyshev.hpp"
#include "vibroimpact/numeric/jet.hpp"
#include "vibroimpact/numeric/mixed_jet.hpp"

namespace binding {

namespace {

inline constexpr int block = 6; // directions carried at once by first-order jets
inline constexpr int small_dimension = 8;
using small_size = vi::bounded<small_dimension, vi::block_contacts>;

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
void fill(R* out, const double* from, int size, const prescribed_data& d, const expansion<R>& at) {
    for (int i = 0; i < size; ++i)
        out[i] = at(from + i, d.count);
}

template <class T>
vi::orbit_state<T> state_at(const numbers& states, int segment, int size) {
    vi::orbit_state<T> z{};
    for (int i = 0; i < size; ++i)
        z[i] = T(states[static_cast<std::size_t>(segment) * size + i]);
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

template <int K>
vi::mixed_jet<K> seeded(double x, const numbers& directions, int column, int width) {
    vi::mixed_jet<K> z(x);
    for (int i = 0; i < K; ++i)
        z.c[1 << i] = directions[static_cast<std::size_t>(i) * width + column];
    return z;
}

// A jet of the parameter alone among the directions of another kind: as that of its e_2.
vi::mixed_jet<2> lifted(const vi::mixed_jet<1>& x) {
    vi::mixed_jet<2> y(x.c[0]);
    y.c[2] = x.c[1];
    return y;
}

// A compiled system in arrays of one shape.
template <class Shape>
class shaped final : public prescribed::motions {
    using dual = vi::jet<double, 1>;
    using mixed = vi::mixed_jet<1>; // rounded otherwise, as the second derivatives are
    template <class R>
    using kernel = vi::prescribed<R, Shape>;
    // With the matrix that it points to; moved, never copied.
    template <class R>
    struct stop : vi::stop<R, Shape::max_dimension> {
        std::unique_ptr<R[]> matrix;
    };
    template <class R>
    using propagator = typename kernel<R>::field_type::propagator;

public:
    explicit shaped(prescribed_data data)
        : data_(std::move(data)), modes_(kernels_of<double>({0.0})) {}

    linearised linearise(const segments& s) const override {
        const int count = s.count(), n = size();
        const auto width = static_cast<std::size_t>(n) + 2;
        linearised out;
        out.after_by.resize(static_cast<std::size_t>(count) * n * width);
        out.gap_by.resize(count * width);
        for (int segment = 0; segment < count; ++segment) {
            const int at = s.stops[segment], mode = data_.stops[at].mode;
            const auto& k = modes_[mode];
            const auto here = stop_of<double>(at, {0.0});
            const double t = s.durations[segment];
            const auto& e = flight_of(mode, t).plain;
            const auto a =
                k.template fly<1>(here, state_at<double>(s.states, segment, n), e, t, 0.0);
            append(out.after, a.after, n);
            append(out.before, a.before, n);
            out.gap.push_back(a.gap);
            out.rate.push_back(a.rate);
            out.rate_after.push_back(a.rate_after);
            by_state(k, s, segment, out, here, e);
            const auto by_parameter = varied<dual>(mode).template fly<1>(
                stop_of<dual>(at, moving<dual>()), state_at<dual>(s.states, segment, n),
                varied_flight_of<dual>(mode, t), dual(t), dual(0.0));
            write_columns<1>(out, by_parameter, segment, n, n + 1, 1);
        }
        return out;
    }

    second_order second(const segments& s, const numbers& directions,
                        bool by_parameter) const override {
        using jet = vi::mixed_jet<2>;
        const int count = s.count(), n = size(), first = by_parameter ? n + 1 : 0;
        const auto width = static_cast<std::size_t>(n + 2 - first);
        second_order out{numbers(count * n * width), numbers(count * width)};
        const auto write = [&](const vi::arrival<jet>& a, int segment, int column) {
            for (int i = 0; i < n; ++i)
                out.after_by[(static_cast<std::size_t>(segment) * n + i) * width + column] =
                    a.after[i].c[3];
            out.gap_by[segment * width + column] = a.gap.c[3];
        };
        const auto moved_kernel = std::make_unique<kernel<jet>>();
        const auto moved_flight = std::make_unique<propagator<jet>>();
        for (int segment = 0; segment < count; ++segment) {
            const int at = s.stops[segment], mode = data_.stops[at].mode;
            const double t = s.durations[segment];
            const double* along = directions.data() + segment * (n + 1);
            if (!by_parameter) {
                const auto here = stop_of<double>(at, {0.0});
                const auto& e = flight_of(mode, t).plain;
                for (int j = 0; j <= n; ++j)
                    write(both_moved(modes_[mode], here, e, s, segment, along, j), segment, j);
            }
            fill_kernel<jet>(*moved_kernel, mode, {jet::direction(1)});
            lift(*moved_flight, varied_flight_of<mixed>(mode, t));
            write(both_moved(*moved_kernel, stop_of<jet>(at, {jet::direction(1)}), *moved_flight, s,
                             segment, along, n + 1),
                  segment, n + 1 - first);
        }
        return out;
    }

    numbers forms(const segments& s, const ends& e, const numbers& directions,
                  int count) const override {
        if (count == 1) return forms_of_order<1>(s, e, directions);
        if (count == 2) return forms_of_order<2>(s, e, directions);
        return forms_of_order<3>(s, e, directions);
    }

    numbers slopes(int stop, double phase) const override {
        const double* row = data_.of_stop(static_cast<std::size_t>(stop));
        const int n = data_.degrees;
        numbers out(size());
        for (int i = 0; i < n; ++i) {
            out[i] = row[2 * i];
            out[n + i] = row[2 * i + 1] / data_.rate;
        }
        for (std::size_t l = 0; l < data_.ratios.size(); ++l) {
            const auto wave = vi::sincos(data_.ratios[l] * phase);
            const double *own = row + 2 * (n + l), ratio = data_.ratios[l];
            out[2 * n] += ratio * (own[0] * wave.c - own[1] * wave.s);
        }
        return out;
    }

    int solved_coordinate(int stop) const override {
        const auto number = static_cast<std::size_t>(stop);
        if (data_.stops[number].map >= 0) return -1;
        const double* row = data_.of_stop(number);
        const int n = data_.degrees;
        int found = 2 * n;
        double largest = 0.0;
        for (int i = 0; i < 2 * n; ++i) {
            const double size = std::abs(row[i < n ? 2 * i : 2 * (i - n) + 1]);
            if (size > 0.0 && size >= largest) {
                largest = size;
                found = i;
            }
        }
        return found;
    }

    chatter_flights chatter(const numbers& state, const numbers& direction, int at) const override {
        const int n = size();
        dual p(0.0);
        p.d[0] = direction[n];
        const expansion<dual> moved{p};
        const auto own =
            std::make_unique<kernel<dual>>(); // matrices of jets are large: on the heap
        kernel<dual>& k = *own;
        fill_kernel(k, data_.stops[at].mode, moved);
        auto z = state_at<dual>(state, 0, n);
        for (int i = 0; i < n; ++i)
            z[i].d[0] = direction[i];
        chatter_flights out;
        dual theta = z[n - 1];
        auto y = k.embed(z);
        k.chatter(stop_of<dual>(at, moved), y, [&](const auto& begun, const dual& t) {
            const auto here = k.read(begun, theta);
            for (int i = 0; i < n; ++i) {
                out.states.push_back(here[i].v);
                out.states_by.push_back(here[i].d[0]);
            }
            out.durations.push_back(t.v);
            out.durations_by.push_back(t.d[0]);
            theta = theta + t * k.omega;
        });
        return out;
    }

    numbers fly(const numbers& states, const std::vector<int>& modes,
                const std::vector<int>& windows, const numbers& nodes,
                double window) const override {
        const int n = size();
        const auto to_node = to_nodes(modes, nodes, window);
        numbers out;
        for (std::size_t segment = 0; segment < windows.size(); ++segment) {
            const auto& k = modes_[modes[segment]];
            const auto& p = to_node[modes[segment]];
            auto y = k.embed(state_at<double>(states, static_cast<int>(segment), n));
            for (int w = 0; w < windows[segment]; ++w) {
                for (std::size_t node = 0; node < nodes.size(); ++node)
                    append(out, k.read(k.field.apply(p[node], y), 0.0), n - 1);
                y = k.field.apply(p.back(), y);
            }
        }
        return out;
    }

    approaches approach(const numbers& states, const numbers& durations,
                        const std::vector<int>& modes, const guards& g, const numbers& nodes,
                        double window, double flat) const override {
        const int width = data_.dimension, terms = static_cast<int>(nodes.size());
        const std::size_t count = durations.size();
        numbers at(nodes);
        for (double& x : at)
            x = 0.5 * window * (1.0 + x);
        const auto to_node = to_nodes(modes, at, window);
        const chebyshev series(terms);
        approaches out;
        out.edges.resize(4 * g.count() * count);
        out.sizes.resize(2 * g.count());
        out.most.resize(width);
        numbers value(terms), rate(terms), zeros;
        std::vector<vi::vec<double, Shape::max_dimension>> y(nodes.size());
        const auto grow = [&](const auto& here) {
            for (int i = 0; i < width; ++i)
                out.most[i] = std::max(out.most[i], std::abs(here[i]));
        };
        for (std::size_t segment = 0; segment < count; ++segment) {
            const auto& k = modes_[modes[segment]];
            const auto& p = to_node[modes[segment]];
            auto begun = k.embed(state_at<double>(states, static_cast<int>(segment), size()));
            grow(begun);
            const double whole = durations[segment];
            const int windows = std::max(1, static_cast<int>(std::ceil(whole / window)));
            for (int w = 0; w < windows; ++w) {
                const double start = w * window;
                for (int j = 0; j < terms; ++j) {
                    y[j] = k.field.apply(p[j], begun);
                    if (start + at[j] <= whole) grow(y[j]);
                }
                for (std::size_t i = 0; i < g.count(); ++i) {
                    if (g.modes[i] != modes[segment]) continue;
                    const double* row = data_.values.data() + g.rows[i];
                    double* sizes = out.sizes.data() + 2 * i;
                    for (int j = 0; j < terms; ++j) {
                        const auto slope = k.field.derivative(y[j]);
                        double u = row[width], moduli = std::abs(row[width]), change = 0.0;
                        for (int c = 0; c < width; ++c) {
                            u += row[c] * y[j][c];
                            moduli += std::abs(row[c] * y[j][c]);
                            change += row[c] * slope[c];
                        }
                        value[j] = u, rate[j] = change;
                        sizes[0] = std::max(sizes[0], moduli);
                        sizes[1] = std::max(sizes[1], std::abs(change));
                    }
                    numbers u(terms), du(terms);
                    series.fit(value.data(), u.data());
                    series.fit(rate.data(), du.data());
                    zeros.clear();
                    series.zeros(du.data(), flat, zeros);
                    for (double x : zeros)
                        out.extrema.insert(out.extrema.end(),
                                           {double(i), double(segment),
                                            start + 0.5 * window * (1.0 + x),
                                            chebyshev_value(u.data(), terms, x)});
                    double* edge = out.edges.data() + 4 * (i * count + segment);
                    const auto write = [&](double* to, double x) {
                        to[0] = chebyshev_value(u.data(), terms, x);
                        to[1] = chebyshev_value(du.data(), terms, x);
                    };
                    if (w == 0) write(edge, -1.0);
                    if (w == windows - 1) write(edge + 2, 2.0 * (whole - start) / window - 1.0);
                }
                begun = k.field.apply(p.back(), begun);
            }
        }
        return out;
    }

private:
    // Flights of one length in one mode, and their derivative by the parameter once it is asked for.
    struct flight {
        int mode;
        double time;
        propagator<double> plain;
        std::tuple<std::unique_ptr<propagator<dual>>, std::unique_ptr<propagator<mixed>>> varied;
    };
    // The latest lengths are kept: what is asked of an orbit is asked for the same ones again.
    static constexpr std::size_t kept_flights = 32;

    int size() const { return 2 * data_.degrees + 1; }
    template <class R>
    static expansion<R> moving() {
        if constexpr (vi::is_same<R, dual>)
            return {dual::variable(0.0, 0)};
        else
            return {mixed::direction(0)};
    }

    template <class R>
    stop<R> stop_of(int number, const expansion<R>& at) const {
        stop<R> s{};
        const double* from = data_.of_stop(static_cast<std::size_t>(number));
        const auto next = [&](R* out, int count) {
            fill(out, from, count, data_, at);
            from += count;
        };
        next(s.row.x, data_.dimension);
        next(&s.limit, 1);
        next(s.impulse.x, data_.dimension);
        next(&s.restitution, 1);
        next(s.kick.x, data_.dimension);
        const auto& own = data_.stops[static_cast<std::size_t>(number)];
        s.chatters = own.chatters;
        if (own.map >= 0) {
            const auto entries = data_.width() * data_.width();
            s.matrix = std::make_unique<R[]>(entries);
            fill(s.matrix.get(), data_.of_map(static_cast<std::size_t>(own.map)),
                 static_cast<int>(entries), data_, at);
            s.map = s.matrix.get();
        }
        return s;
    }

    template <class R>
    void fill_kernel(kernel<R>& k, int mode, const expansion<R>& at) const {
        const int width = data_.dimension;
        k.field.dimension_ = width;
        k.degrees = data_.degrees;
        k.lines = static_cast<int>(data_.ratios.size());
        k.rate = data_.rate;
        std::copy(data_.ratios.begin(), data_.ratios.end(), k.ratio);
        fill(&k.omega, data_.values.data(), 1, data_, at);
        k.field.step = data_.steps[mode];
        fill(k.field.constant.x, data_.constant(mode), width, data_, at);
        for (int i = 0; i < width; ++i)
            fill(k.field.b[i].x, data_.field(mode) + i * width, width, data_, at);
    }

    template <class R>
    std::vector<kernel<R>> kernels_of(const expansion<R>& at) const {
        std::vector<kernel<R>> out(data_.steps.size());
        for (std::size_t m = 0; m < out.size(); ++m)
            fill_kernel(out[m], static_cast<int>(m), at);
        return out;
    }

    // With derivatives by the parameter, which not every call needs.
    template <class R>
    const kernel<R>& varied(int mode) const {
        auto& modes = std::get<std::vector<kernel<R>>>(varied_modes_);
        if (modes.empty()) modes = kernels_of<R>(moving<R>());
        return modes[mode];
    }

    flight& flight_of(int mode, double t) const {
        for (flight& one : flights_)
            if (one.mode == mode && one.time == t) return one;
        if (flights_.size() == kept_flights) flights_.erase(flights_.begin());
        flights_.push_back({mode, t, modes_[mode].field.at_time(t), {}});
        return flights_.back();
    }

    template <class R>
    const propagator<R>& varied_flight_of(int mode, double t) const {
        auto& own = std::get<std::unique_ptr<propagator<R>>>(flight_of(mode, t).varied);
        if (!own) own = std::make_unique<propagator<R>>(varied<R>(mode).field.at_time(R(t)));
        return *own;
    }

    // Propagators of the modes that occur to each of some times and, last, over a whole window.
    std::vector<std::vector<propagator<double>>>
    to_nodes(const std::vector<int>& modes, const numbers& times, double window) const {
        std::vector<std::vector<propagator<double>>> out(modes_.size());
        for (std::size_t m = 0; m < modes_.size(); ++m) {
            if (std::find(modes.begin(), modes.end(), static_cast<int>(m)) == modes.end()) continue;
            for (double t : times)
                out[m].push_back(modes_[m].field.at_time(t));
            out[m].push_back(modes_[m].field.at_time(window));
        }
        return out;
    }

    void lift(propagator<vi::mixed_jet<2>>& to, const propagator<mixed>& from) const {
        for (int i = 0; i < data_.dimension; ++i) {
            to.shift[i] = lifted(from.shift[i]);
            for (int j = 0; j < data_.dimension; ++j)
                to.change[i][j] = lifted(from.change[i][j]);
        }
    }

    // By the state and the time: B is constant.
    void by_state(const kernel<double>& k, const segments& s, int segment, linearised& out,
                  const stop<double>& at, const propagator<double>& e) const {
        using jet = vi::jet<double, block>;
        const int n = size();
        const double t = s.durations[segment];
        for (int first = 0; first <= n; first += block) {
            const int count = std::min(block, n + 1 - first);
            auto z = state_at<jet>(s.states, segment, n);
            jet dt(0.0);
            for (int j = 0; j < count; ++j)
                (first + j < n ? z[first + j] : dt).d[j] = 1.0;
            write_columns<block>(out, k.template fly<1>(at, z, e, t, dt), segment, n, first, count);
        }
    }

    // Second derivatives of one segment by the direction of e_1 and the number that e_2 moves.
    template <class R>
    vi::arrival<vi::mixed_jet<2>> both_moved(const kernel<R>& k, const stop<R>& at,
                                             const propagator<R>& e, const segments& s, int segment,
                                             const double* along, int moved) const {
        using jet = vi::mixed_jet<2>;
        const int n = size();
        auto z = state_at<jet>(s.states, segment, n);
        jet dt(0.0);
        for (int i = 0; i < n; ++i)
            z[i].c[1] = along[i];
        dt.c[1] = along[n];
        if (moved <= n) (moved < n ? z[moved] : dt).c[2] = 1.0;
        return k.template fly<2>(at, z, e, R(s.durations[segment]), dt);
    }

    // The map over all segments.
    template <class R, int K>
    numbers map_forms(const segments& s, const ends& e, const expansion<R>& at,
                      const numbers& directions) const {
        using T = vi::mixed_jet<K>;
        constexpr bool fixed = vi::is_same<R, double>;
        const int n = size();
        std::vector<kernel<R>> own;
        if constexpr (!fixed) own = kernels_of<R>(at);
        const auto mode_of = [&](int mode) -> const kernel<R>& {
            if constexpr (fixed)
                return modes_[mode];
            else
                return own[mode];
        };
        const auto flown = [&](int mode, double t) {
            if constexpr (fixed)
                return flight_of(mode, t).plain;
            else
                return own[mode].field.at_time(R(t));
        };
        vi::orbit_state<T> z{};
        for (int i = 0; i < n; ++i)
            z[i] = seeded<K>(s.states[i], directions, i, n + 1);
        if (e.stop >= 0) mode_of(0).put_on(stop_of<R>(e.stop, at), z, e.solved);
        T elapsed(0.0);
        for (int segment = 0; segment < s.count(); ++segment) {
            const double t = s.durations[segment];
            if (segment > 0) { // values stay on the orbit, whose instability would carry them off
                const auto known = state_at<double>(s.states, segment, n);
                for (int i = 0; i < n; ++i)
                    z[i].c[0] = known[i];
            }
            if (s.stops[segment] >= 0) {
                const int number = s.stops[segment], mode = data_.stops[number].mode;
                elapsed = elapsed + mode_of(mode).template impact<K>(stop_of<R>(number, at), z,
                                                                     flown(mode, t), t);
            } else {
                const T period = T(0.0) + at(e.period.data(), 1);
                const T dt = period - elapsed;
                mode_of(e.mode).template coast<K>(z, flown(e.mode, t), t, dt - vi::value(dt));
                elapsed = period;
            }
        }
        numbers out;
        for (int subset = 0; subset < T::size; ++subset) {
            for (int i = 0; i < n; ++i)
                out.push_back(z[i].c[subset]);
            out.push_back(elapsed.c[subset]);
        }
        return out;
    }

    template <int K>
    numbers forms_of_order(const segments& s, const ends& e, const numbers& directions) const {
        const int width = size() + 1;
        const auto dp = seeded<K>(0.0, directions, width - 1, width);
        const bool fixed = std::all_of(dp.c, dp.c + dp.size, [](double x) { return x == 0.0; });
        return fixed ? map_forms<double, K>(s, e, {0.0}, directions)
                     : map_forms<vi::mixed_jet<K>, K>(s, e, {dp}, directions);
    }

    prescribed_data data_;
    std::vector<kernel<double>> modes_;
    mutable std::tuple<std::vector<kernel<dual>>, std::vector<kernel<mixed>>> varied_modes_;
    mutable std::vector<flight> flights_;
};

} // namespace

prescribed::prescribed(prescribed_data data) : degrees_(data.degrees), dimension_(data.width()) {
    if (data.dimension <= small_dimension)
        motions_ = std::make_unique<shaped<small_size>>(std::move(data));
    else
        motions_ = std::make_unique<shaped<vi::any_size>>(std::move(data));
}

} // namespace binding
