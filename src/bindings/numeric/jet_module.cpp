#include "numeric/jet_module.hpp"

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <nanobind/operators.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "numeric/jet_power.hpp"
#include "numeric/recording.hpp"
#include "vibroimpact/numeric/mixed_jet.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

namespace {

jet from_coefficients(double value, const std::vector<double>& coefficients) {
    jet x(value);
    if (coefficients.size() != jet::size)
        throw std::invalid_argument("coefficients: 8 numbers, one per set of directions.");
    for (int s = 1; s < jet::size; ++s)
        x.c[s] = coefficients[s];
    return x;
}

// x > 0 rounded down to its first binary digits, and the next such number.
struct rounded {
    double low, high;
};
rounded rounded_down(double x, int bits) {
    int exponent = 0;
    const double digits = std::floor(std::ldexp(std::frexp(x, &exponent), bits));
    return {std::ldexp(digits, exponent - bits), std::ldexp(digits + 1.0, exponent - bits)};
}

bool finite(const jet& x) {
    for (double c : x.c)
        if (!std::isfinite(c)) return false;
    return true;
}

recorded number_of(const std::shared_ptr<recording>& in, int number) {
    return {in->value(number), in, number};
}

// The operand's number in the recording of another one.
int of(const recorded&, const recorded& x) {
    return x.number;
}
int of(const recorded& with, double x) {
    return with.in->constant(x);
}
const recorded& owner(const recorded& a, const recorded&) {
    return a;
}
const recorded& owner(const recorded& a, double) {
    return a;
}
const recorded& owner(double, const recorded& b) {
    return b;
}

template <class A, class B>
recorded both(operation what, const A& a, const B& b, double value) {
    const auto& in = owner(a, b).in;
    return number_of(in, in->result(what, of(owner(a, b), a), of(owner(a, b), b), value));
}

recorded alone(operation what, const recorded& x, double value) {
    return number_of(x.in, x.in->result(what, x.number, x.number, value));
}

template <class A, class B>
bool compared(relation what, const A& a, const B& b, bool held) {
    owner(a, b).in->compare(what, of(owner(a, b), a), of(owner(a, b), b), held);
    return held;
}

double plain(const recorded& x) {
    return x.value;
}
double plain(double x) {
    return x;
}

template <class A, class B, class Class>
void bind_arithmetic(Class& c, const char* add, const char* subtract, const char* multiply,
                     const char* divide) {
    // Python gives the number itself first, also where it stands on the right.
    constexpr bool turned = vi::is_same<A, double>;
    const auto bind = [&c](const char* name, operation what, auto compute) {
        c.def(
            name,
            [what, compute](const recorded& self,
                            std::conditional_t<turned, double, const B&> other) {
                if constexpr (turned)
                    return both(what, other, self, compute(other, plain(self)));
                else
                    return both(what, self, other, compute(plain(self), plain(other)));
            },
            nb::is_operator());
    };
    bind(add, operation::add, [](double x, double y) { return x + y; });
    bind(subtract, operation::subtract, [](double x, double y) { return x - y; });
    bind(multiply, operation::multiply, [](double x, double y) { return x * y; });
    bind(divide, operation::divide, [](double x, double y) { return x / y; });
}

template <class B, class Class>
void bind_comparisons(Class& c) {
    const auto bind = [&c](const char* name, auto compare) {
        c.def(
            name, [compare](const recorded& a, const B& b) { return compare(a, b); },
            nb::is_operator());
    };
    bind("__lt__", [](const recorded& a, const B& b) {
        return compared(relation::less, a, b, plain(a) < plain(b));
    });
    bind("__le__", [](const recorded& a, const B& b) {
        return compared(relation::less_equal, a, b, plain(a) <= plain(b));
    });
    bind("__gt__", [](const recorded& a, const B& b) {
        return compared(relation::less, b, a, plain(b) < plain(a));
    });
    bind("__ge__", [](const recorded& a, const B& b) {
        return compared(relation::less_equal, b, a, plain(b) <= plain(a));
    });
}

recorded modulus(const recorded& x) {
    return compared(relation::less, x, 0.0, x.value < 0.0) ? alone(operation::negate, x, -x.value)
                                                           : x;
}

void bind_recording(nb::module_& m) {
    nb::class_<recorded> number(
        m, "Recorded",
        "A number of a recording. It has a value; derivatives come with repetition.");
    bind_arithmetic<recorded, recorded>(number, "__add__", "__sub__", "__mul__", "__truediv__");
    bind_arithmetic<recorded, double>(number, "__add__", "__sub__", "__mul__", "__truediv__");
    bind_arithmetic<double, recorded>(number, "__radd__", "__rsub__", "__rmul__", "__rtruediv__");
    bind_comparisons<recorded>(number);
    bind_comparisons<double>(number);
    number.def("__neg__", [](const recorded& x) { return alone(operation::negate, x, -x.value); })
        .def("__pos__", [](const recorded& x) { return x; })
        .def("__abs__", &modulus)
        .def("__pow__", [](const recorded& x,
                           double a) { return both(operation::power, x, a, power(x.value, a)); })
        .def(
            "__eq__",
            [](const recorded& x, nb::handle other) {
                recorded y;
                double z = 0.0;
                if (nb::try_cast(other, y))
                    return compared(relation::equal, x, y, x.value == y.value);
                return nb::try_cast(other, z) && compared(relation::equal, x, z, x.value == z);
            },
            nb::sig("def __eq__(self, arg: object, /) -> bool"))
        .def("__hash__", [](const recorded& x) { return nb::hash(nb::float_(x.value)); })
        .def("__bool__",
             [](const recorded& x) { return !compared(relation::equal, x, 0.0, x.value == 0.0); })
        .def_prop_ro("value",
                     [](const recorded& x) { // what is read as a float must not change
                         compared(relation::equal, x, x.value, true);
                         return x.value;
                     })
        .def(
            "rounded_down",
            [](const recorded& x, int bits) {
                const auto [low, high] = rounded_down(x.value, bits);
                compared(relation::less, x, low, false);
                compared(relation::less, x, high, true);
                return low;
            },
            "bits"_a)
        .def_prop_ro("finite",
                     [](const recorded& x) {
                         return compared(relation::finite, x, 0.0, std::isfinite(x.value));
                     })
        .def("sqrt", [](const recorded& x) { return alone(operation::root, x, vi::sqrt(x.value)); })
        .def("exp", [](const recorded& x) { return alone(operation::exp, x, vi::exp(x.value)); })
        .def("log", [](const recorded& x) { return alone(operation::log, x, vi::log(x.value)); })
        .def("sin",
             [](const recorded& x) { return alone(operation::sin, x, vi::sincos(x.value).s); })
        .def("cos",
             [](const recorded& x) { return alone(operation::cos, x, vi::sincos(x.value).c); });
    nb::class_<recording>(
        m, "Recording",
        "A computation with parameters, recorded once and repeated at other values of them.\n\n"
        "Numbers that depend on parameters are :class:`Recorded`. Comparisons of them are\n"
        "conditions: where one has another outcome the computation is not repeated. That of\n"
        "explorer/recording.py is another one, which the explorer's page repeats.")
        .def(nb::init<>())
        .def(
            "parameter",
            [](const std::shared_ptr<recording>& self, double value) {
                return number_of(self, self->parameter(value));
            },
            "value"_a, "The next parameter.")
        .def(
            "close",
            [](recording& self, const nb::list& outputs) {
                std::vector<int> numbers;
                for (nb::handle x : outputs) {
                    recorded r;
                    numbers.push_back(nb::try_cast(x, r) ? r.number
                                                         : self.constant(nb::cast<double>(x)));
                }
                self.set_outputs(std::move(numbers));
            },
            "outputs"_a, nb::sig("def close(self, outputs: list[typing.Any]) -> None"),
            "End the recording with the numbers that it is made for.")
        .def(
            "repeat",
            [](recording& self, const std::vector<double>& parameters, int by) -> nb::object {
                auto found = self.repeat(parameters, by);
                if (!found) return nb::none();
                return to_numpy(std::move(*found), {4, self.outputs()});
            },
            "parameters"_a, "by"_a,
            nb::sig("def repeat(self, parameters: list[float], by: int) -> "
                    "numpy.typing.NDArray[numpy.float64] | None"),
            "The outputs with three derivatives by a parameter, in rows; None where a condition "
            "fails.");
}

} // namespace

void bind_jet(nb::module_& m) {
    nb::class_<jet>(
        m, "Jet",
        "A number with infinitely small parts along three directions e1, e2, e3.\n\n"
        "``coefficients[s]`` belongs to the product of the e_i in the bit mask s. With\n"
        "x + u e1 + v e2 + w e3 a function gives f at 0, D f[u] at 1, D f[v] at 2,\n"
        "D^2 f[u, v] at 3 and D^3 f[u, v, w] at 7. Comparisons look at values.")
        .def(nb::init_implicit<double>(), "value"_a)
        .def_static("of", &from_coefficients, "value"_a, "coefficients"_a)
        .def_static(
            "variable",
            [](double value) {
                jet x(value);
                for (int i = 0; i < jet::order; ++i)
                    x = x + jet::direction(i);
                return x;
            },
            "value"_a, "Seeded in all directions: derivatives are coefficients 1, 3 and 7.")
        .def_prop_ro("value", [](const jet& x) { return x.c[0]; })
        .def_prop_ro("coefficients",
                     [](const jet& x) { return std::vector<double>(x.c, x.c + jet::size); })
        .def_prop_ro("finite", &finite)
        .def(nb::self + nb::self)
        .def(nb::self - nb::self)
        .def(nb::self * nb::self)
        .def(nb::self / nb::self)
        .def(nb::self + double())
        .def(nb::self - double())
        .def(nb::self * double())
        .def(nb::self / double())
        .def(double() + nb::self)
        .def(double() - nb::self)
        .def(double() * nb::self)
        .def(double() / nb::self)
        .def(-nb::self)
        .def("__pos__", [](const jet& x) { return x; })
        .def("__abs__", [](const jet& x) { return x < 0.0 ? -x : x; })
        .def("__pow__", &power<jet>)
        .def(nb::self < nb::self)
        .def(nb::self <= nb::self)
        .def(nb::self > nb::self)
        .def(nb::self >= nb::self)
        .def(nb::self < double())
        .def(nb::self <= double())
        .def(nb::self > double())
        .def(nb::self >= double())
        .def(
            "__eq__",
            [](const jet& x, nb::handle other) {
                jet y;
                return nb::try_cast(other, y) && x == y;
            },
            nb::sig("def __eq__(self, arg: object, /) -> bool"))
        .def("__bool__", [](const jet& x) { return x.c[0] != 0.0; })
        .def("__hash__",
             [](const jet& x) {
                 return nb::hash(nb::cast(std::vector<double>(x.c, x.c + jet::size)));
             })
        .def(
            "rounded_down", [](const jet& x, int bits) { return rounded_down(x.c[0], bits).low; },
            "bits"_a, "The value, > 0, rounded down to so many binary digits.")
        .def("sqrt", [](const jet& x) { return vi::sqrt(x); })
        .def("exp", [](const jet& x) { return vi::exp(x); })
        .def("log", [](const jet& x) { return vi::log(x); })
        .def("sin", [](const jet& x) { return vi::sincos(x).s; })
        .def("cos", [](const jet& x) { return vi::sincos(x).c; })
        .def("__repr__", [](const jet& x) {
            std::string out = "Jet(";
            for (int s = 0; s < jet::size; ++s)
                out += (s ? ", " : "") + std::string(nb::str(nb::float_(x.c[s])).c_str());
            return out + ")";
        });
    bind_recording(m);
}

} // namespace binding
