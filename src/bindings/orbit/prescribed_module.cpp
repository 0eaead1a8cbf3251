#include "orbit/prescribed_module.hpp"

#include <cstdint>
#include <stdexcept>
#include <tuple>

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "numeric/chebyshev.hpp"
#include "orbit/closing.hpp"
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

nb::object linearise(const prescribed& p, const array& states, const array& durations,
                     std::vector<int> stops) {
    const std::size_t count = stops.size(), size = 2 * p.degrees() + 1;
    auto r = p->linearise({numbers_of(states), numbers_of(durations), std::move(stops)});
    return nb::make_tuple(to_numpy(std::move(r.before), {count, size}),
                          to_numpy(std::move(r.after), {count, size}),
                          to_numpy(std::move(r.gap), {count}), to_numpy(std::move(r.rate), {count}),
                          to_numpy(std::move(r.rate_after), {count}),
                          to_numpy(std::move(r.after_by), {count, size, size + 2}),
                          to_numpy(std::move(r.gap_by), {count, size + 2}));
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

// Arguments of the constructor, which are its state, too.
using closing_arguments = std::tuple<int, int, std::vector<int>, std::vector<int>, numbers, numbers,
                                     numbers, std::vector<int>>;

void bind_closing(nb::module_& m) {
    nb::class_<closing>(m, "Closing")
        .def(
            "__init__",
            [](closing* self, int entries, int segments, std::vector<int> kept,
               std::vector<int> source, numbers signs, numbers turn, numbers relative,
               std::vector<int> pivots) {
                new (self) closing({entries, segments, std::move(kept), std::move(source),
                                    std::move(signs), std::move(turn), std::move(relative),
                                    std::move(pivots)});
            },
            "entries"_a, "segments"_a, "kept"_a, "source"_a, "signs"_a, "turn"_a, "relative"_a,
            "pivots"_a)
        .def("__getstate__",
             [](const closing& c) {
                 const auto& d = c.data();
                 return closing_arguments{d.entries, d.segments, d.kept,     d.source,
                                          d.signs,   d.turn,     d.relative, d.pivots};
             })
        .def("__setstate__",
             [](closing& self, const closing_arguments& given) {
                 new (&self) closing(std::make_from_tuple<closing_data>(given));
             })
        .def(
            "unpacked",
            [](const closing& c, const array& z) {
                const auto count = static_cast<std::size_t>(c.data().segments),
                           entries = static_cast<std::size_t>(c.data().entries);
                if (z.size() != c.unknowns())
                    throw std::invalid_argument("z: not so many unknowns.");
                auto [states, durations] = c.unpacked(z.data());
                return nb::make_tuple(to_numpy(std::move(states), {count, entries}),
                                      to_numpy(std::move(durations), {count}));
            },
            "z"_a,
            nb::sig("def unpacked(self, z: numpy.typing.NDArray[numpy.float64]) "
                    "-> tuple[numpy.typing.NDArray[numpy.float64], "
                    "numpy.typing.NDArray[numpy.float64]]"))
        .def(
            "equations",
            [](const closing& c, const array& z, const array& after, const array& gap,
               const array& after_by, const array& gap_by) {
                const std::size_t d = c.unknowns();
                auto [left, by] = c.equations(
                    z.data(), {after.data(), gap.data(), after_by.data(), gap_by.data()});
                return nb::make_tuple(to_numpy(std::move(left), {d}),
                                      to_numpy(std::move(by), {d, d + 1}));
            },
            "z"_a, "after"_a, "gap"_a, "after_by"_a, "gap_by"_a,
            nb::sig("def equations(self, z: numpy.typing.NDArray[numpy.float64], "
                    "after: numpy.typing.NDArray[numpy.float64], "
                    "gap: numpy.typing.NDArray[numpy.float64], "
                    "after_by: numpy.typing.NDArray[numpy.float64], "
                    "gap_by: numpy.typing.NDArray[numpy.float64]) "
                    "-> tuple[numpy.typing.NDArray[numpy.float64], "
                    "numpy.typing.NDArray[numpy.float64]]"))
        .def(
            "pencil",
            [](const closing& c, const array& after_by, const array& gap_by, const array& tangents,
               const std::vector<int>& chosen, const array& rows, const array& columns) {
                const std::size_t whole = rows.size();
                return to_numpy(c.pencil({nullptr, nullptr, after_by.data(), gap_by.data()},
                                         tangents.data(), chosen, rows.data(), columns.data()),
                                {whole, whole});
            },
            "after_by"_a, "gap_by"_a, "tangents"_a, "chosen"_a, "rows"_a, "columns"_a,
            nb::sig("def pencil(self, after_by: numpy.typing.NDArray[numpy.float64], "
                    "gap_by: numpy.typing.NDArray[numpy.float64], "
                    "tangents: numpy.typing.NDArray[numpy.float64], chosen: list[int], "
                    "rows: numpy.typing.NDArray[numpy.float64], "
                    "columns: numpy.typing.NDArray[numpy.float64]) "
                    "-> numpy.typing.NDArray[numpy.float64]"));
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
    bind_closing(m);
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
                     "-> tuple[numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64], numpy.typing.NDArray[numpy.float64], "
                     "numpy.typing.NDArray[numpy.float64]]"))
        .def(
            "slopes",
            [](const prescribed& p, int stop, double phase) {
                return to_numpy(p->slopes(stop, phase), {2 * p.degrees() + 1});
            },
            "stop"_a, "phase"_a,
            nb::sig("def slopes(self, stop: int, phase: float) "
                    "-> numpy.typing.NDArray[numpy.float64]"))
        .def(
            "solved_coordinate",
            [](const prescribed& p, int stop) { return p->solved_coordinate(stop); }, "stop"_a)
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
