#include "ensemble/batch_module.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "engine/small.hpp"
#include "ensemble/batch.hpp"
#include "ensemble/observer_table.hpp"
#include "interrupt.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

namespace {

using indices = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// By name of an array: places of the numbers that vary, and the rows of `columns` that they are in.
using varied_places = std::map<std::string, std::map<std::size_t, std::size_t>>;

class batch {
    using fields = vi::batch_arrays;

public:
    batch(bool dense, bool mixed, bool sequential, int degrees, const array& columns,
          const varied_places& varied, const array& omegas, const array& kappas, const array& steps,
          const array& impulse, const array& mobility, const array& shift, const array& restitution,
          const array& damping, bool piecewise,
          const std::vector<std::tuple<int, bool, bool>>& elements, const array& reset_shift,
          const array& reset_matrix, bool given)
        : dense_(dense), piecewise_(piecewise), columns_(columns) {
        if (columns.ndim() != 2 || omegas.ndim() != 1 || impulse.ndim() != 2 ||
            reset_shift.ndim() != 2)
            throw std::invalid_argument(
                "columns must have 2 axes (V, S), omegas 1 (L), impulse 2 (C, D), reset_shift 2 "
                "(R, D).");
        const std::size_t s = columns.shape(1), lines = omegas.shape(0), c = impulse.shape(0);
        const std::size_t d = 2 * (static_cast<std::size_t>(degrees) + lines);
        const std::size_t most = dense ? vi::largest_dimension : vi::block_dimension;
        const std::size_t contacts = dense ? vi::most_contacts : vi::block_contacts;
        const bool fits = d <= most && c + elements.size() >= 1 && c <= contacts &&
                          elements.size() <= vi::most_elements && lines <= vi::max_lines;
        const bool flown = dense || !piecewise;
        if (s == 0 || degrees < 1 || !fits || !flown || (!piecewise && !elements.empty()))
            throw std::invalid_argument("a batch needs at least one system, and sizes that fit.");
        one_.systems = 1;
        if (sequential) one_.together = vi::impact_law::sequential;
        one_.degrees = degrees;
        one_.lines = static_cast<long long>(lines);
        one_.contacts = static_cast<long long>(c);
        one_.mixed = mixed;
        for (const auto& [states, soft, joint] : elements) {
            states_.push_back(states);
            soft_.push_back(soft);
            joint_.push_back(joint);
        }
        one_.elements = static_cast<long long>(states_.size());
        one_.resets = static_cast<long long>(reset_shift.shape(0));
        one_.given = given;
        one_.states = states_.data();
        one_.soft = soft_.data();
        one_.joint = joint_.data();
        add({{"omegas", &fields::omegas, omegas, lines},
             {"kappas", &fields::kappas, kappas, lines},
             {"steps", &fields::steps, steps, 1},
             {"impulse", &fields::impulse, impulse, c * d},
             {"mobility", &fields::mobility, mobility, c * c},
             {"shift", &fields::shift, shift, c * d},
             {"restitution", &fields::restitution, restitution, c * 2},
             {"damping", &fields::damping, damping,
              static_cast<std::size_t>(degrees) * static_cast<std::size_t>(degrees)},
             {"reset_shift", &fields::reset_shift, reset_shift, reset_shift.shape(0) * d},
             {"reset_matrix", &fields::reset_matrix, reset_matrix, reset_shift.shape(0) * d * d}},
            varied);
    }

    void add_mode(int code, const varied_places& varied, const nb::dict& flow, const array& rows,
                  const array& gains, const array& lower, const array& upper,
                  const std::vector<int>& side, const array& to_x, const array& to_v,
                  const array& offset, const array& from_x, const array& from_v,
                  const array& particular, const nb::dict& piecewise) {
        const auto [n, lines, c, d] = sizes();
        if (side.size() != c || (codes_.empty() && code != 0))
            throw std::invalid_argument("side: one per contact; the free mode, code 0, is first.");
        const auto of_flow = [&](const char* name) { return nb::cast<array>(flow[name]); };
        std::vector<part> parts{{"rows", &fields::rows, rows, c * d},
                                {"gains", &fields::gains, gains, c},
                                {"lower", &fields::lower, lower, c},
                                {"upper", &fields::upper, upper, c},
                                {"to_x", &fields::to_x, to_x, n * d},
                                {"to_v", &fields::to_v, to_v, n * d},
                                {"offset", &fields::offset, offset, n},
                                {"from_x", &fields::from_x, from_x, d * n},
                                {"from_v", &fields::from_v, from_v, d * n},
                                {"particular", &fields::particular, particular, d * 2 * lines}};
        if (dense_) {
            parts.push_back({"b", &fields::b, of_flow("b"), d * d});
            parts.push_back({"constant", &fields::constant, of_flow("constant"), d});
            parts.push_back({"norm", &fields::norm, of_flow("norm"), d * d});
            parts.push_back({"growth", &fields::growth, of_flow("growth"), 1});
        } else {
            parts.push_back({"k", &fields::k, of_flow("k"), d / 2});
            parts.push_back({"c", &fields::c, of_flow("c"), d / 2});
            parts.push_back({"a", &fields::a, of_flow("a"), d / 2});
        }
        std::vector<int> of_watch, held, reset, target;
        if (piecewise_) {
            of_watch = nb::cast<std::vector<int>>(piecewise["watch_element"]);
            held = nb::cast<std::vector<int>>(piecewise["watch_held"]);
            reset = nb::cast<std::vector<int>>(piecewise["watch_reset"]);
            target = nb::cast<std::vector<int>>(piecewise["watch_target"]);
            const std::size_t count = of_watch.size();
            const auto other = [&](int e) { return e < 0 || e >= one_.elements; };
            const auto unknown = [&](int r) { return r < -1 || r >= one_.resets; };
            // the shape of hybrid systems is that of the most elements
            const std::size_t most = 3 * (one_.given ? vi::most_elements : states_.size());
            if (held.size() != count || reset.size() != count || target.size() != count ||
                count > most || std::any_of(of_watch.begin(), of_watch.end(), other) ||
                std::any_of(reset.begin(), reset.end(), unknown))
                throw std::invalid_argument(
                    "watches: at most three of each element, 24 of a hybrid "
                    "system, resets that there are.");
            const auto named = [&](const char* name) { return nb::cast<array>(piecewise[name]); };
            parts.push_back({"mode_step", &fields::mode_steps, named("mode_step"), 1});
            parts.push_back({"map_shift", &fields::map_shift, named("map_shift"), d});
            parts.push_back({"watch_rows", &fields::watch_rows, named("watch_rows"), count * d});
            parts.push_back({"watch_gains", &fields::watch_gains, named("watch_gains"), count});
            parts.push_back({"watch_lower", &fields::watch_lower, named("watch_lower"), count});
            parts.push_back({"watch_upper", &fields::watch_upper, named("watch_upper"), count});
            parts.push_back({"element_rows", &fields::element_rows, named("element_rows"),
                             states_.size() * 2 * (d + 1)});
        }
        add(parts, varied);
        if (piecewise_) {
            counts_.push_back(static_cast<int>(of_watch.size()));
            of_watch_.insert(of_watch_.end(), of_watch.begin(), of_watch.end());
            held_.insert(held_.end(), held.begin(), held.end());
            reset_.insert(reset_.end(), reset.begin(), reset.end());
            target_.insert(target_.end(), target.begin(), target.end());
            one_.watch_counts = counts_.data();
            one_.watch_element = of_watch_.data();
            one_.watch_held = held_.data();
            one_.watch_reset = reset_.data();
            one_.watch_target = target_.data();
        }
        codes_.push_back(code);
        sides_.insert(sides_.end(), side.begin(), side.end());
        one_.codes = codes_.data();
        one_.side = sides_.data();
        one_.modes = static_cast<long long>(codes_.size());
    }

    nb::dict run(const indices& system, const array& position, const array& velocity,
                 const array& phases, const array& settle, const array& observe, long most_impacts,
                 const nb::dict& observers) const {
        if (codes_.empty()) throw std::invalid_argument("the batch has no mode yet.");
        const std::size_t count = system.size();
        const auto [n, lines, c, d] = sizes();
        const std::vector<int> systems(system.data(), system.data() + count), first(count);
        for (int one : systems)
            if (one < 0 || static_cast<std::size_t>(one) >= columns_.shape(1))
                throw std::invalid_argument("system: an index outside the batch.");
        owned_arrays here;
        here.view = one_;
        here.view.members = static_cast<long long>(count);
        here.view.system = first.data();
        here.view.most_impacts = most_impacts;
        here.add({{"position", &fields::position, position, count * n},
                  {"velocity", &fields::velocity, velocity, count * n},
                  {"phases", &fields::phases, phases, count * lines},
                  {"settle", &fields::settle, settle, count},
                  {"observe", &fields::observe, observe, count}});
        read_observers(observers, here);
        results out(here.view);
        const auto interrupted = interrupted_here();
        {
            const nb::gil_scoped_release release;
            const bool small = d == 6 && lines == 1 && c == 1;
            const auto run_blocks = !small       ? run_modal
                                    : one_.mixed ? run_modal_small_mixed
                                                 : run_modal_small;
            const bool few = !one_.given && is_small(d, c, states_.size());
            const auto run_whole = few ? run_dense_small : run_dense;
            (dense_ ? run_whole : run_blocks)({numbers_, here.view, systems.data()}, interrupted);
        }
        raise_if_interrupted();
        return out.to_python();
    }

private:
    using part = owned_arrays::part;

    // Coordinates, forcing lines, contacts and entries of y of a system.
    struct counts {
        std::size_t degrees, lines, contacts, dimension;
    };
    counts sizes() const {
        const auto size = [](long long x) { return static_cast<std::size_t>(x); };
        return {size(one_.degrees), size(one_.lines), size(one_.contacts),
                size(2 * (one_.degrees + one_.lines))};
    }

    // Take in arrays, or none of them.
    void add(const std::vector<part>& parts, const varied_places& varied) {
        owned_arrays::check_sizes(parts);
        check_names(parts, varied);
        std::vector<system_numbers::varied_places> places;
        for (const auto& p : parts)
            places.push_back(places_in(p, varied));
        for (std::size_t i = 0; i < parts.size(); ++i)
            numbers_.add(parts[i].field, parts[i].from.data(), parts[i].size, places[i]);
    }

    static void check_names(const std::vector<part>& parts, const varied_places& varied) {
        for (const auto& [name, places] : varied)
            if (std::none_of(parts.begin(), parts.end(),
                             [&](const part& p) { return name == p.name; }))
                throw std::invalid_argument("varied: there is no array '" + name + "' here.");
    }

    system_numbers::varied_places places_in(const part& p, const varied_places& varied) const {
        system_numbers::varied_places out;
        const auto found = varied.find(p.name);
        if (found == varied.end()) return out;
        const std::size_t rows = columns_.shape(0), systems = columns_.shape(1);
        for (const auto& [place, row] : found->second) {
            if (place >= p.size || row >= rows)
                throw std::invalid_argument(std::string(p.name) + ": varied outside its numbers.");
            out.emplace_back(place, columns_.data() + row * systems);
        }
        return out;
    }

    bool dense_, piecewise_;
    array columns_; // the systems' own numbers (V, S)
    system_numbers numbers_{};
    vi::batch_arrays one_{};
    std::vector<int> codes_, sides_;
    std::vector<int> states_, soft_, joint_; // of elements
    // of watches, modes one after the other
    std::vector<int> counts_, of_watch_, held_, reset_, target_;
};

} // namespace

void bind_batch(nb::module_& m) {
    nb::class_<stop_sign>(m, "StopSign", "Ends the runs of members in all threads that obey it.")
        .def(nb::init<>())
        .def("set", &stop_sign::set)
        .def("is_set", &stop_sign::is_set);
    m.def("observers", observer_table,
          nb::sig("def observers() -> dict[str, tuple[dict[str, tuple[typing.Any, ...]], "
                  "tuple[str, ...]]]"),
          "Observers by name: their options, each with its kind and range, and their tables.");
    m.def(
        "obey", [](const stop_sign& sign) { obeyed = &sign; }, "sign"_a,
        "Let this thread obey a sign, which has to outlive it.");
    nb::class_<batch>(
        m, "Batch",
        "Systems of one structure with different numbers, and the members that run in "
        "them.\n\nArrays are C-contiguous float64. Those of systems are of one, as hybrid.Compiled "
        "gives\nthem to System. Numbers that vary are in the columns (V, S), which are kept, "
        "not copied:\n`varied` has by name of an array the rows of their columns by place. Arrays "
        "of members\nhave a leading axis of members.")
        .def(nb::init<bool, bool, bool, int, const array&, const varied_places&, const array&,
                      const array&, const array&, const array&, const array&, const array&,
                      const array&, const array&, bool,
                      const std::vector<std::tuple<int, bool, bool>>&, const array&, const array&,
                      bool>(),
             "dense"_a, "mixed"_a, "sequential"_a, "degrees"_a, "columns"_a, "varied"_a, "omegas"_a,
             "kappas"_a, "steps"_a, "impulse"_a, "mobility"_a, "shift"_a, "restitution"_a,
             "damping"_a, "piecewise"_a, "elements"_a, "reset_shift"_a, "reset_matrix"_a, "given"_a,
             nb::sig("def __init__(self, *, dense: bool, mixed: bool, sequential: bool, "
                     "degrees: int, columns: numpy.typing.NDArray[numpy.float64], "
                     "varied: dict[str, dict[int, int]], "
                     "omegas: numpy.typing.NDArray[numpy.float64], "
                     "kappas: numpy.typing.NDArray[numpy.float64], "
                     "steps: numpy.typing.NDArray[numpy.float64], "
                     "impulse: numpy.typing.NDArray[numpy.float64], "
                     "mobility: numpy.typing.NDArray[numpy.float64], "
                     "shift: numpy.typing.NDArray[numpy.float64], "
                     "restitution: numpy.typing.NDArray[numpy.float64], "
                     "damping: numpy.typing.NDArray[numpy.float64], piecewise: bool, "
                     "elements: list[tuple[int, bool, bool]], "
                     "reset_shift: numpy.typing.NDArray[numpy.float64], "
                     "reset_matrix: numpy.typing.NDArray[numpy.float64], given: bool) -> None"))
        .def("add_mode", &batch::add_mode, "code"_a, "varied"_a, "flow"_a, "rows"_a, "gains"_a,
             "lower"_a, "upper"_a, "side"_a, "to_x"_a, "to_v"_a, "offset"_a, "from_x"_a, "from_v"_a,
             "particular"_a, "piecewise"_a,
             nb::sig("def add_mode(self, *, code: int, "
                     "varied: dict[str, dict[int, int]], "
                     "flow: dict[str, numpy.typing.NDArray[numpy.float64]], "
                     "rows: numpy.typing.NDArray[numpy.float64], "
                     "gains: numpy.typing.NDArray[numpy.float64], "
                     "lower: numpy.typing.NDArray[numpy.float64], "
                     "upper: numpy.typing.NDArray[numpy.float64], side: list[int], "
                     "to_x: numpy.typing.NDArray[numpy.float64], "
                     "to_v: numpy.typing.NDArray[numpy.float64], "
                     "offset: numpy.typing.NDArray[numpy.float64], "
                     "from_x: numpy.typing.NDArray[numpy.float64], "
                     "from_v: numpy.typing.NDArray[numpy.float64], "
                     "particular: numpy.typing.NDArray[numpy.float64], "
                     "piecewise: dict[str, typing.Any]) -> None"))
        .def("run", &batch::run, "system"_a, "position"_a, "velocity"_a, "phases"_a, "settle"_a,
             "observe"_a, "most_impacts"_a, "observers"_a,
             nb::sig("def run(self, *, system: numpy.typing.NDArray[numpy.int32], "
                     "position: numpy.typing.NDArray[numpy.float64], "
                     "velocity: numpy.typing.NDArray[numpy.float64], "
                     "phases: numpy.typing.NDArray[numpy.float64], "
                     "settle: numpy.typing.NDArray[numpy.float64], "
                     "observe: numpy.typing.NDArray[numpy.float64], most_impacts: int, "
                     "observers: dict[str, typing.Any]) "
                     "-> dict[str, numpy.typing.NDArray[typing.Any]]"));
}

} // namespace binding
