// Python module vibroimpact._kernel: System over the compiled shapes, Batch, Prescribed, Jet.
#include <stdexcept>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "engine/small.hpp"
#include "engine/system.hpp"
#include "ensemble/batch_module.hpp"
#include "interrupt.hpp"
#include "numeric/decoupling_module.hpp"
#include "numeric/jet_module.hpp"
#include "numeric/pace_module.hpp"
#include "orbit/prescribed_module.hpp"
#include "vibroimpact/numeric/math.hpp"
#include "vibroimpact/numeric/sizes.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using binding::array;
using binding::interrupted;
using binding::numbers;
using binding::numbers_of;
using binding::raise_if_interrupted;
using binding::to_numpy;

binding::system_data read_system(bool mixed, int dimension, int degrees, numbers omegas,
                                 numbers kappas, double step, const nb::list& laws,
                                 const std::vector<std::tuple<int, bool, bool>>& elements,
                                 bool given, bool sequential) {
    binding::system_data data{
        dimension, degrees, mixed, std::move(omegas), std::move(kappas), step, {}, {}, {}, {}};
    data.given = given;
    data.sequential = sequential;
    for (const auto& [states, soft, joint] : elements) {
        data.states.push_back(states);
        data.soft.push_back(soft);
        data.joint.push_back(joint);
    }
    for (nb::handle law : laws) {
        const auto t = nb::cast<std::tuple<numbers, numbers, numbers, double, double>>(law);
        data.contacts.push_back(
            {std::get<0>(t), std::get<1>(t), std::get<2>(t), {std::get<3>(t), std::get<4>(t)}});
    }
    return data;
}

numbers flattened(nb::handle rows) {
    numbers out;
    for (nb::handle row : rows)
        for (nb::handle x : row)
            out.push_back(nb::cast<double>(x));
    return out;
}

class kernel_system {
public:
    kernel_system(bool dense, bool mixed, int dimension, int degrees, numbers omegas,
                  numbers kappas, double step, const nb::list& laws,
                  const std::vector<std::tuple<int, bool, bool>>& elements, bool given,
                  bool sequential)
        : step_(step) {
        const auto data = read_system(mixed, dimension, degrees, std::move(omegas),
                                      std::move(kappas), step, laws, elements, given, sequential);
        const bool small =
            !mixed && dimension == 6 && data.omegas.size() == 1 && data.contacts.size() == 1;
        const bool few = !given && binding::is_small(static_cast<std::size_t>(dimension),
                                                     data.contacts.size(), data.states.size());
        system_ = dense   ? (few ? binding::make_dense_small : binding::make_dense)(data)
                  : small ? binding::make_modal_small(data)
                          : binding::make_modal(data);
        dimension_ = static_cast<std::size_t>(dimension);
        degrees_ = static_cast<std::size_t>(degrees);
        lines_ = data.omegas.size();
    }

    void add_mode(int code, const nb::dict& flow, const nb::list& guards, const nb::list& watches,
                  const array& to_x, const array& to_v, numbers offset, const array& from_x,
                  const array& from_v, const array& particular, numbers shift) {
        binding::mode_data data{code,
                                step_,
                                {},
                                {},
                                {},
                                {},
                                {},
                                {},
                                0.0,
                                {},
                                {},
                                numbers_of(to_x),
                                numbers_of(to_v),
                                std::move(offset),
                                numbers_of(from_x),
                                numbers_of(from_v),
                                numbers_of(particular),
                                std::move(shift)};
        if (flow.contains("k")) {
            data.k = nb::cast<numbers>(flow["k"]);
            data.c = nb::cast<numbers>(flow["c"]);
            data.a = nb::cast<numbers>(flow["a"]);
        } else {
            data.b = flattened(flow["b"]);
            data.constant = nb::cast<numbers>(flow["constant"]);
            if (flow.contains("norm")) {
                data.norm = flattened(flow["norm"]);
                data.growth = nb::cast<numbers>(flow["growth"]).at(0);
            }
            if (flow.contains("step")) data.step = nb::cast<numbers>(flow["step"]).at(0);
        }
        for (nb::handle guard : guards) {
            const auto t = nb::cast<std::tuple<numbers, double, double, double, int>>(guard);
            data.guards.push_back(
                {std::get<0>(t), std::get<1>(t), std::get<2>(t), std::get<3>(t), std::get<4>(t)});
        }
        for (nb::handle watch : watches) {
            const auto t =
                nb::cast<std::tuple<numbers, double, double, double, int, bool, int, int>>(watch);
            data.watches.push_back(
                {{std::get<0>(t), std::get<1>(t), std::get<2>(t), std::get<3>(t), 0},
                 std::get<4>(t),
                 std::get<5>(t),
                 std::get<6>(t),
                 std::get<7>(t)});
        }
        system_->add_mode(data);
    }

    nb::dict start(numbers x, numbers v, numbers phases) const {
        const auto s = system_->start({std::move(x), std::move(v), std::move(phases)});
        nb::dict out;
        out["at"] = nb::cast(s.at);
        out["gap_lower"] = s.gap_lower;
        out["gap_upper"] = s.gap_upper;
        out["eps"] = s.eps;
        return out;
    }

    int add_reset(const array& matrix, const numbers& shift) {
        return system_->add_reset(numbers_of(matrix), shift);
    }

    int settle(binding::position& at) const { return system_->settle(at); }

    nb::dict simulate(binding::position& at, double t_max, double flight_limit, long events,
                      long impacts) const {
        binding::record r;
        {
            nb::gil_scoped_release release;
            r = system_->simulate(at, {t_max, flight_limit, events, impacts, interrupted});
        }
        raise_if_interrupted();
        const std::size_t n = r.status.size();
        nb::dict out;
        out["why"] = r.why;
        out["code"] = r.code;
        out["status"] = to_numpy(std::move(r.status), {n});
        out["contact"] = to_numpy(std::move(r.contact), {n});
        out["side"] = to_numpy(std::move(r.side), {n});
        out["mode"] = to_numpy(std::move(r.mode), {n});
        out["high"] = to_numpy(std::move(r.high), {n});
        out["low"] = to_numpy(std::move(r.low), {n});
        out["rate_before"] = to_numpy(std::move(r.rate_before), {n});
        out["rate_after"] = to_numpy(std::move(r.rate_after), {n});
        out["y"] = to_numpy(std::move(r.y), {n, dimension_});
        out["before"] = to_numpy(std::move(r.before), {n, 2 * degrees_});
        out["after"] = to_numpy(std::move(r.after), {n, 2 * degrees_});
        out["phase"] = to_numpy(std::move(r.phase), {n, lines_});
        return out;
    }

    std::tuple<int, int, long> advance(binding::position& at, double t_max, double flight_limit,
                                       long events, long impacts) const {
        binding::progress p{};
        {
            nb::gil_scoped_release release;
            p = system_->advance(at, {t_max, flight_limit, events, impacts, interrupted});
        }
        raise_if_interrupted();
        return {p.why, p.code, p.events};
    }

    nb::object evaluate(std::vector<int> mode, const array& y, const array& dt) const {
        numbers out;
        {
            const numbers from = numbers_of(y), since = numbers_of(dt);
            nb::gil_scoped_release release;
            out = system_->evaluate(mode, from, since, interrupted);
        }
        raise_if_interrupted();
        return to_numpy(std::move(out), {dt.size(), 2 * degrees_});
    }

    nb::dict tangents(numbers x, numbers v, numbers phases, const array& seeds, double t_max,
                      double flight_limit, long events, long impacts) const {
        const int count = static_cast<int>(seeds.shape(1));
        binding::tangent_result r;
        {
            const numbers columns = numbers_of(seeds);
            nb::gil_scoped_release release;
            r = system_->tangents({std::move(x), std::move(v), std::move(phases)}, columns, count,
                                  {t_max, flight_limit, events, impacts, interrupted});
        }
        raise_if_interrupted();
        nb::dict out;
        out["why"] = r.why;
        out["code"] = r.code;
        out["events"] = r.events;
        out["columns"] = to_numpy(std::move(r.columns), {2 * degrees_ + lines_, seeds.shape(1)});
        out["durations"] = to_numpy(std::move(r.durations), {seeds.shape(1)});
        return out;
    }

    nb::dict lyapunov(const binding::position& at, double t_max, double flight_limit, long events,
                      long impacts, long block) const {
        binding::lyapunov_result r;
        {
            nb::gil_scoped_release release;
            r = system_->lyapunov(at, {t_max, flight_limit, events, impacts, interrupted}, block);
        }
        raise_if_interrupted();
        const std::size_t n = r.growth.size();
        nb::dict out;
        out["why"] = r.why;
        out["code"] = r.code;
        out["events"] = r.events;
        out["growth"] = to_numpy(std::move(r.growth), {n});
        out["time"] = to_numpy(std::move(r.time), {n});
        return out;
    }

    nb::dict spectrum(const binding::position& at, double t_max, double flight_limit, long events,
                      long impacts, long block, int count) const {
        binding::lyapunov_result r;
        {
            nb::gil_scoped_release release;
            r = system_->spectrum(at, {t_max, flight_limit, events, impacts, interrupted}, block,
                                  count);
        }
        raise_if_interrupted();
        const std::size_t n = r.time.size();
        nb::dict out;
        out["why"] = r.why;
        out["code"] = r.code;
        out["events"] = r.events;
        out["growth"] = to_numpy(std::move(r.growth), {n, static_cast<std::size_t>(count)});
        out["time"] = to_numpy(std::move(r.time), {n});
        return out;
    }

    nb::object acceleration(numbers x, numbers v, numbers phases) const {
        return to_numpy(system_->acceleration({std::move(x), std::move(v), std::move(phases)}),
                        {degrees_});
    }
    nb::object flow_matrix(double dt) const {
        return to_numpy(system_->flow_matrix(dt), {2 * degrees_, 2 * degrees_ + 2 * lines_});
    }
    nb::object impact_matrix(int contact, int side) const {
        return to_numpy(system_->impact_matrix(contact, side), {degrees_, degrees_});
    }

private:
    std::unique_ptr<binding::system> system_;
    std::size_t dimension_, degrees_, lines_;
    double step_;
};

} // namespace

#define VI_MODULE(name, variable) NB_MODULE(name, variable) // expands the name first
VI_MODULE(VIBROIMPACT_MODULE, m) {
    nb::set_leak_warnings(false); // of systems that a thread still holds when the interpreter ends
    m.def("version", [] { return VIBROIMPACT_VERSION; });
    m.attr("MAX_DEGREES") = vi::max_degrees;
    m.attr("MAX_CONTACTS") = vi::most_contacts;
    m.attr("MAX_LINES") = vi::max_lines;
    m.attr("BLOCK_DEGREES") = vi::block_degrees;
    m.attr("BLOCK_CONTACTS") = vi::block_contacts;
    m.attr("BLOCK_LINES") = vi::block_lines;
    m.def(
        "sincos",
        [](double x) {
            const auto w = vi::sincos(x);
            return std::make_tuple(w.s, w.c);
        },
        "x"_a, "Sine and cosine with the kernel's own bits.");
    binding::bind_jet(m);
    binding::bind_prescribed(m);
    binding::bind_batch(m);
    binding::bind_decoupling(m);
    binding::bind_pace(m);
    nb::class_<binding::position>(m, "Position")
        .def("copy", [](const binding::position& p) { return binding::position(p); })
        .def_ro("touching", &binding::position::touching)
        .def_ro("rate", &binding::position::rate)
        .def_ro("y", &binding::position::y)
        .def_rw("mode", &binding::position::mode)
        .def_rw("states", &binding::position::states);
    // Signatures are written out for the type stub; arrays are C-contiguous float64.
    nb::class_<kernel_system>(m, "System")
        .def(
            nb::init<bool, bool, int, int, numbers, numbers, double, const nb::list&,
                     const std::vector<std::tuple<int, bool, bool>>&, bool, bool>(),
            "dense"_a, "mixed"_a, "dimension"_a, "degrees"_a, "omegas"_a, "kappas"_a, "step"_a,
            "laws"_a, "elements"_a, "given"_a, "sequential"_a,
            nb::sig("def __init__(self, *, dense: bool, mixed: bool, dimension: int, degrees: int, "
                    "omegas: list[float], kappas: list[float], step: float, "
                    "laws: list[tuple[list[float], list[float], list[float], float, float]], "
                    "elements: list[tuple[int, bool, bool]], given: bool, sequential: bool) "
                    "-> None"))
        .def("add_mode", &kernel_system::add_mode, "code"_a, "flow"_a, "guards"_a, "watches"_a,
             "to_x"_a, "to_v"_a, "offset"_a, "from_x"_a, "from_v"_a, "particular"_a, "shift"_a,
             nb::sig("def add_mode(self, *, code: int, flow: dict[str, object], "
                     "guards: list[tuple[list[float], float, float, float, int]], "
                     "watches: list[tuple[list[float], float, float, float, int, bool, int, int]], "
                     "to_x: numpy.typing.NDArray[numpy.float64], to_v: "
                     "numpy.typing.NDArray[numpy.float64], "
                     "offset: list[float], from_x: numpy.typing.NDArray[numpy.float64], "
                     "from_v: numpy.typing.NDArray[numpy.float64], particular: "
                     "numpy.typing.NDArray[numpy.float64], shift: list[float]) -> None"))
        .def("start", &kernel_system::start, "x"_a, "v"_a, "phases"_a,
             nb::sig("def start(self, x: list[float], v: list[float], phases: list[float]) "
                     "-> dict[str, typing.Any]"))
        .def("add_reset", &kernel_system::add_reset, "matrix"_a, "shift"_a,
             nb::sig("def add_reset(self, *, matrix: numpy.typing.NDArray[numpy.float64], "
                     "shift: list[float]) -> int"))
        .def("settle", &kernel_system::settle, "at"_a,
             nb::sig("def settle(self, at: Position) -> int"))
        .def("simulate", &kernel_system::simulate, "at"_a, "t_max"_a, "flight_limit"_a, "events"_a,
             "impacts"_a,
             nb::sig("def simulate(self, at: Position, t_max: float, flight_limit: float, "
                     "events: int, impacts: int) -> dict[str, typing.Any]"))
        .def("advance", &kernel_system::advance, "at"_a, "t_max"_a, "flight_limit"_a, "events"_a,
             "impacts"_a,
             nb::sig("def advance(self, at: Position, t_max: float, flight_limit: float, "
                     "events: int, impacts: int) -> tuple[int, int, int]"))
        .def("evaluate", &kernel_system::evaluate, "mode"_a, "y"_a, "dt"_a,
             nb::sig(
                 "def evaluate(self, mode: list[int], y: numpy.typing.NDArray[numpy.float64], "
                 "dt: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]"))
        .def("tangents", &kernel_system::tangents, "x"_a, "v"_a, "phases"_a, "seeds"_a, "t_max"_a,
             "flight_limit"_a, "events"_a, "impacts"_a,
             nb::sig(
                 "def tangents(self, x: list[float], v: list[float], phases: list[float], "
                 "seeds: numpy.typing.NDArray[numpy.float64], t_max: float, flight_limit: float, "
                 "events: int, impacts: int) -> dict[str, typing.Any]"))
        .def("lyapunov", &kernel_system::lyapunov, "at"_a, "t_max"_a, "flight_limit"_a, "events"_a,
             "impacts"_a, "block"_a,
             nb::sig("def lyapunov(self, at: Position, t_max: float, flight_limit: float, "
                     "events: int, impacts: int, block: int) -> dict[str, typing.Any]"))
        .def("spectrum", &kernel_system::spectrum, "at"_a, "t_max"_a, "flight_limit"_a, "events"_a,
             "impacts"_a, "block"_a, "count"_a,
             nb::sig("def spectrum(self, at: Position, t_max: float, flight_limit: float, "
                     "events: int, impacts: int, block: int, count: int) "
                     "-> dict[str, typing.Any]"))
        .def("acceleration", &kernel_system::acceleration, "x"_a, "v"_a, "phases"_a,
             nb::sig("def acceleration(self, x: list[float], v: list[float], "
                     "phases: list[float]) -> numpy.typing.NDArray[numpy.float64]"))
        .def("flow_matrix", &kernel_system::flow_matrix, "dt"_a,
             nb::sig("def flow_matrix(self, dt: float) -> numpy.typing.NDArray[numpy.float64]"))
        .def("impact_matrix", &kernel_system::impact_matrix, "contact"_a, "side"_a,
             nb::sig("def impact_matrix(self, contact: int, side: int) -> "
                     "numpy.typing.NDArray[numpy.float64]"));
}
