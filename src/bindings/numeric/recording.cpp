#include "numeric/recording.hpp"

#include <algorithm>
#include <cmath>

#include "numeric/jet_power.hpp"

namespace binding {

int recording::keep(double x, kind of) {
    values_.push_back(x);
    kinds_.push_back(of);
    return static_cast<int>(values_.size()) - 1;
}

int recording::parameter(double x) {
    parameters_.push_back(keep(x, kind::parameter));
    return parameters_.back();
}

int recording::result(operation what, int a, int b, double value) {
    const int to = keep(value, kind::result);
    steps_.push_back({what, a, b, to});
    return to;
}

void recording::compare(relation what, int a, int b, bool held) {
    conditions_.push_back({what, a, b, held});
}

void recording::set_outputs(std::vector<int> outputs) {
    outputs_ = std::move(outputs);
    std::vector<bool> wanted(values_.size());
    for (int output : outputs_)
        wanted[output] = true;
    needed_.clear();
    for (auto s = steps_.rbegin(); s != steps_.rend(); ++s) {
        if (!wanted[s->to]) continue;
        wanted[s->a] = wanted[s->b] = true;
        needed_.push_back(*s);
    }
    std::reverse(needed_.begin(), needed_.end());
    jets_.assign(values_.begin(), values_.end());
}

// A constant operand is a double, so that results have the bits of jets and floats in Python.
template <class T>
T recording::repeated(const step& s, const std::vector<T>& at) const {
    const T& a = at[s.a];
    const bool left = kinds_[s.a] == kind::constant, right = kinds_[s.b] == kind::constant;
    const double fixed_a = values_[s.a], fixed_b = values_[s.b];
    switch (s.what) {
    case operation::add:
        return left ? fixed_a + at[s.b] : right ? a + fixed_b : a + at[s.b];
    case operation::subtract:
        return left ? fixed_a - at[s.b] : right ? a - fixed_b : a - at[s.b];
    case operation::multiply:
        return left ? fixed_a * at[s.b] : right ? a * fixed_b : a * at[s.b];
    case operation::divide:
        return left ? fixed_a / at[s.b] : right ? a / fixed_b : a / at[s.b];
    case operation::power:
        return power(a, fixed_b);
    case operation::negate:
        return -a;
    case operation::root:
        return vi::sqrt(a);
    case operation::exp:
        return vi::exp(a);
    case operation::log:
        return vi::log(a);
    case operation::sin:
        return vi::sincos(a).s;
    case operation::cos:
        return vi::sincos(a).c;
    }
    return a;
}

bool recording::holds() const {
    return std::all_of(conditions_.begin(), conditions_.end(), [this](const condition& c) {
        const double a = values_[c.a], b = values_[c.b];
        switch (c.what) {
        case relation::less:
            return (a < b) == c.held;
        case relation::less_equal:
            return (a <= b) == c.held;
        case relation::equal:
            return (a == b) == c.held;
        case relation::finite:
            return std::isfinite(a) == c.held;
        }
        return false;
    });
}

std::optional<std::vector<double>> recording::repeat(const std::vector<double>& parameters,
                                                     int by) {
    for (std::size_t i = 0; i < parameters_.size(); ++i)
        values_[parameters_[i]] = parameters[i];
    for (const step& s : steps_)
        values_[s.to] = repeated(s, values_);
    if (!holds()) return std::nullopt;
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
        jet& x = jets_[parameters_[i]] = jet(parameters[i]);
        if (static_cast<int>(i) == by)
            for (int k = 0; k < jet::order; ++k)
                x = x + jet::direction(k);
    }
    for (const step& s : needed_)
        jets_[s.to] = repeated(s, jets_);
    constexpr int orders[4] = {0, 1, 3, 7};
    std::vector<double> out;
    out.reserve(4 * outputs_.size());
    for (int order : orders)
        for (int output : outputs_)
            out.push_back(jets_[output].c[order]);
    return out;
}

} // namespace binding
