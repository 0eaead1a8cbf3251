// A computation with numbers of a system, recorded once and repeated at other values of its parameters.
//
// Method      Every operation on a number that depends on a parameter is a step; every comparison of such
//             numbers is a condition, with the outcome that it had. While all conditions hold at other
//             values, the same steps give the bits of the whole computation there, with derivatives by
//             one of the parameters. Else it has to be recorded anew: other steps might be taken.
// Assumes     numbers leave the computation by its outputs, or by comparisons
// Fails       nothing comes back where a condition no longer holds
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "vibroimpact/numeric/mixed_jet.hpp"

namespace binding {

using jet = vi::mixed_jet<3>;

enum class operation { add, subtract, multiply, divide, power, negate, root, exp, log, sin, cos };
enum class relation { less, less_equal, equal, finite };

class recording {
public:
    // Numbers are counted: constants, parameters and results.
    int constant(double x) { return keep(x, kind::constant); }
    int parameter(double x);
    int result(operation what, int a, int b, double value);
    void compare(relation what, int a, int b, bool held);
    double value(int number) const { return values_[number]; }

    void set_outputs(std::vector<int> outputs);
    // f, f', f'', f''' of the outputs in four rows, by one of the parameters.
    std::optional<std::vector<double>> repeat(const std::vector<double>& parameters, int by);
    std::size_t outputs() const { return outputs_.size(); }

private:
    enum class kind : unsigned char { constant, parameter, result };
    struct step {
        operation what;
        int a, b, to;
    };
    struct condition {
        relation what;
        int a, b;
        bool held;
    };
    int keep(double x, kind of);
    template <class T>
    T repeated(const step& s, const std::vector<T>& at) const;
    bool holds() const;

    std::vector<double> values_;
    std::vector<kind> kinds_;
    std::vector<int> parameters_, outputs_;
    std::vector<step> steps_;
    std::vector<step> needed_; // those on which outputs depend
    std::vector<condition> conditions_;
    std::vector<jet> jets_;
};

// A number of a recording.
struct recorded {
    double value = 0.0;
    std::shared_ptr<recording> in;
    int number = 0;
};

} // namespace binding
