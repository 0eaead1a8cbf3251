#include "numeric/jet_module.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <nanobind/operators.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "vibroimpact/numeric/mixed_jet.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

namespace {

using jet = vi::mixed_jet<3>;

jet from_coefficients(double value, const std::vector<double>& coefficients) {
    jet x(value);
    if (coefficients.size() != jet::size)
        throw std::invalid_argument("coefficients: 8 numbers, one per set of directions.");
    for (int s = 1; s < jet::size; ++s)
        x.c[s] = coefficients[s];
    return x;
}

jet whole_power(const jet& x, int n) {
    if (n < 0) return 1.0 / whole_power(x, -n);
    jet result(1.0);
    for (int i = 0; i < n; ++i)
        result = result * x;
    return result;
}

jet power(const jet& x, double a) {
    if (a == std::floor(a) && std::abs(a) <= 64.0) return whole_power(x, static_cast<int>(a));
    if (a == 0.5) return vi::sqrt(x);
    return vi::exp(a * vi::log(x));
}

bool finite(const jet& x) {
    for (double c : x.c)
        if (!std::isfinite(c)) return false;
    return true;
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
        .def("__pow__", &power)
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
}

} // namespace binding
