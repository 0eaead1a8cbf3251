#include "orbit/prescribed_module.hpp"

#include <cstdint>
#include <stdexcept>
#include <tuple>

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "numeric/chebyshev.hpp"
#include "orbit/prescribed.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

namespace {

prescribed make(int degrees, numbers ratios, double rate, numbers steps,
                const std::vector<std::tuple<int, bool, int>>& stops, const array& values) {
    prescribed_data data{degrees,
                         2 * (degrees + static_cast<int>(ratios.size())),
                         std::move(ratios),
                         rate,
                         std::move(steps),
                         {},
                         numbers_of(values),
                         values.size() / parameter_orders};
    for (const auto& [mode, chatters, map] : stops)
        data.stops.push_back({mode, chatters, map});
    if (data.count < data.least_count())
        throw std::invalid_argument("values: too few for these modes and stops.");
    return prescribed(std::move(data));
}

nb::dict linearise(const prescribed& p, const array& states, const array& durations,
                   std::vector<int> stops) {
    const std::size_t count = stops.size(), size = 2 * p.degrees() + 1;
    auto r = p->linearise({numbers_of(states), numbers_of(durations), std::move(stops)});
    nb::dict out;
    out["after"] = to_numpy(std::move(r.after), {count, size});
    out["before"] = to_numpy(std::move(r.before), {count, size});
    out["gap"] = to_numpy(std::move(r.gap), {count});
    out["rate"] = to_numpy(std::move(r.rate), {count});
    out["rate_after"] = to_numpy(std::move(r.rate_after), {count});
    out["after_by"] = to_numpy(std::move(r.after_by), {count, size, size + 2});
    out["gap_by"] = to_numpy(std::move(r.gap_by), {count, size + 2});
    return out;
}

nb::object second(const prescribed& p, const array& states, const array& durations,
                  std::vector<int> stops, const array& directions, bool by_parameter) {
    const std::size_t count = stops.size(), size = 2 * p.degrees() + 1,
                      width = by_parameter ? 1 : size + 2;
    auto r = p->second({numbers_of(states), numbers_of(durations), std::move(stops)},
                       numbers_of(directions), by_parameter);
    return nb::make_tuple(to_numpy(std::move(r.after_by), {count, size, width}),
                          to_numpy(std::move(r.gap_by), {count, width}));
}

nb::object forms(const prescribed& p, const array& states, const array& durations,
                 std::vector<int> stops, int start, int solved, const array& period, int mode,
                 const array& directions) {
    const std::size_t count = directions.shape(0);
    auto out = p->forms({numbers_of(states), numbers_of(durations), std::move(stops)},
                        {start, solved, numbers_of(period), mode}, numbers_of(directions),
                        static_cast<int>(count));
    return to_numpy(std::move(out), {std::size_t{1} << count, 2 * p.degrees() + 2});
}

nb::object fly(const prescribed& p, const array& states, const std::vector<int>& modes,
               const std::vector<int>& windows, const array& nodes, double window) {
    std::size_t total = 0;
    for (int count : windows)
        total += static_cast<std::size_t>(count);
    return to_numpy(p->fly(numbers_of(states), modes, windows, numbers_of(nodes), window),
                    {total, nodes.size(), 2 * p.degrees()});
}

nb::object approach(const prescribed& p, const array& states, const array& durations,
                    const std::vector<int>& modes, std::vector<int> guard_modes,
                    std::vector<int> rows, const array& nodes, double window, double flat) {
    const std::size_t guards = rows.size(), segments = modes.size();
    auto r =
        p->approach(numbers_of(states), numbers_of(durations), modes,
                    {std::move(guard_modes), std::move(rows)}, numbers_of(nodes), window, flat);
    const std::size_t count = r.extrema.size() / 4;
    return nb::make_tuple(to_numpy(std::move(r.extrema), {count, 4}),
                          to_numpy(std::move(r.edges), {guards, segments, 4}),
                          to_numpy(std::move(r.sizes), {guards, 2}),
                          to_numpy(std::move(r.most), {p.dimension()}));
}

nb::object chatter(const prescribed& p, const array& state, const array& direction, int stop) {
    auto r = p->chatter(numbers_of(state), numbers_of(direction), stop);
    const std::size_t count = r.durations.size(), size = 2 * p.degrees() + 1;
    return nb::make_tuple(to_numpy(std::move(r.states), {count, size}),
                          to_numpy(std::move(r.durations), {count}),
                          to_numpy(std::move(r.states_by), {count, size}),
                          to_numpy(std::move(r.durations_by), {count}));
}

} // namespace

void bind_prescribed(nb::module_& m) {
    m.def(
        "zeros_of_series",
        [](const array& coefficients, double rounding) {
            const std::size_t count = coefficients.shape(0), terms = coefficients.shape(1);
            const chebyshev series(static_cast<int>(terms));
            std::vector<std::int64_t> numbers;
            std::vector<double> zeros;
            for (std::size_t i = 0; i < count; ++i) {
                series.zeros(coefficients.data() + i * terms, rounding, zeros);
                numbers.resize(zeros.size(), static_cast<std::int64_t>(i));
            }
            const std::size_t found = zeros.size();
            return nb::make_tuple(to_numpy(std::move(numbers), {found}),
                                  to_numpy(std::move(zeros), {found}));
        },
        "coefficients"_a, "rounding"_a,
        nb::sig("def zeros_of_series(coefficients: numpy.typing.NDArray[numpy.float64], "
                "rounding: float) -> tuple[numpy.typing.NDArray[numpy.int64], "
                "numpy.typing.NDArray[numpy.float64]]"),
        "Zeros in [-1, 1] of Chebyshev series in rows, with the numbers of their series.");
    nb::class_<prescribed>(m, "Prescribed")
        .def(
            "__init__",
            [](prescribed* self, int degrees, numbers ratios, double rate, numbers steps,
               const std::vector<std::tuple<int, bool, int>>& stops, const array& values) {
                new (self) prescribed(
                    make(degrees, std::move(ratios), rate, std::move(steps), stops, values));
            },
            "degrees"_a, "ratios"_a, "rate"_a, "steps"_a, "stops"_a, "values"_a,
            nb::sig("def __init__(self, *, degrees: int, ratios: list[float], rate: float, "
                    "steps: list[float], stops: list[tuple[int, bool, int]], "
                    "values: numpy.typing.NDArray[numpy.float64]) -> None"))
        .def("linearise", &linearise, "states"_a, "durations"_a, "stops"_a,
             nb::sig("def linearise(self, states: numpy.typing.NDArray[numpy.float64], "
                     "durations: numpy.typing.NDArray[numpy.float64], stops: list[int]) "
                     "-> dict[str, typing.Any]"))
        .def("second", &second, "states"_a, "durations"_a, "stops"_a, "directions"_a,
             "by_parameter"_a,
             nb::sig("def second(self, states: numpy.typing.NDArray[numpy.float64], "
                     "durations: numpy.typing.NDArray[numpy.float64], stops: list[int], "
                     "directions: numpy.typing.NDArray[numpy.float64], by_parameter: bool) "
                     "-> tuple[numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64]]"))
        .def(
            "forms", &forms, "states"_a, "durations"_a, "stops"_a, "start"_a, "solved"_a,
            "period"_a, "mode"_a, "directions"_a,
            nb::sig("def forms(self, states: numpy.typing.NDArray[numpy.float64], "
                    "durations: numpy.typing.NDArray[numpy.float64], stops: list[int], start: int, "
                    "solved: int, period: numpy.typing.NDArray[numpy.float64], mode: int, "
                    "directions: numpy.typing.NDArray[numpy.float64]) "
                    "-> numpy.typing.NDArray[numpy.float64]"))
        .def("chatter", &chatter, "state"_a, "direction"_a, "stop"_a,
             nb::sig("def chatter(self, state: numpy.typing.NDArray[numpy.float64], "
                     "direction: numpy.typing.NDArray[numpy.float64], stop: int) "
                     "-> tuple[numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64]]"))
        .def("approach", &approach, "states"_a, "durations"_a, "modes"_a, "guard_modes"_a, "rows"_a,
             "nodes"_a, "window"_a, "flat"_a,
             nb::sig("def approach(self, states: numpy.typing.NDArray[numpy.float64], "
                     "durations: numpy.typing.NDArray[numpy.float64], modes: list[int], "
                     "guard_modes: list[int], rows: list[int], "
                     "nodes: numpy.typing.NDArray[numpy.float64], window: float, flat: float) "
                     "-> tuple[numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64]]"))
        .def(
            "fly", &fly, "states"_a, "modes"_a, "windows"_a, "nodes"_a, "window"_a,
            nb::sig(
                "def fly(self, states: numpy.typing.NDArray[numpy.float64], "
                "modes: list[int], windows: list[int], nodes: numpy.typing.NDArray[numpy.float64], "
                "window: float) -> numpy.typing.NDArray[numpy.float64]"));
}

} // namespace binding
