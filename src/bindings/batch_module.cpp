#include "batch_module.hpp"

#include <cstdint>
#include <stdexcept>

#include <nanobind/stl/vector.h>

#include "batch.hpp"
#include "interrupt.hpp"
#include "owned_arrays.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

namespace {

using indices = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

class batch {
    using fields = vi::batch_arrays;

public:
    batch(bool dense, int degrees, const array& omegas, const array& kappas, const array& steps,
          const array& impulse, const array& mobility, const array& shift, const array& restitution)
        : dense_(dense) {
        if (omegas.ndim() != 2 || impulse.ndim() != 3)
            throw std::invalid_argument("omegas must have 2 axes (S, L), impulse 3 (S, C, D).");
        const std::size_t s = omegas.shape(0), lines = omegas.shape(1), c = impulse.shape(1);
        const std::size_t d = 2 * (static_cast<std::size_t>(degrees) + lines);
        const bool fits = d <= 32 && c >= 1 && c <= 8 && lines <= vi::max_lines;
        if (s == 0 || degrees < 1 || !fits)
            throw std::invalid_argument("a batch needs at least one system, and sizes that fit.");
        auto& b = data_.view;
        b.systems = static_cast<long long>(s);
        b.degrees = degrees;
        b.lines = static_cast<long long>(lines);
        b.contacts = static_cast<long long>(c);
        data_.add({{"omegas", &fields::omegas, omegas, s * lines},
                   {"kappas", &fields::kappas, kappas, s * lines},
                   {"steps", &fields::steps, steps, s},
                   {"impulse", &fields::impulse, impulse, s * c * d},
                   {"mobility", &fields::mobility, mobility, s * c * c},
                   {"shift", &fields::shift, shift, s * c * d},
                   {"restitution", &fields::restitution, restitution, s * c * 2}});
    }

    void add_mode(int code, const nb::dict& flow, const array& rows, const array& gains,
                  const array& lower, const array& upper, const std::vector<int>& side,
                  const array& to_x, const array& to_v, const array& offset, const array& from_x,
                  const array& from_v, const array& particular) {
        auto& b = data_.view;
        const auto [s, n, lines, c, d] = sizes();
        if (side.size() != c || (codes_.empty() && code != 0))
            throw std::invalid_argument("side: one per contact; the free mode, code 0, is first.");
        const auto of_flow = [&](const char* name) { return nb::cast<array>(flow[name]); };
        std::vector<owned_arrays::part> parts{
            {"rows", &fields::rows, rows, s * c * d},
            {"gains", &fields::gains, gains, s * c},
            {"lower", &fields::lower, lower, s * c},
            {"upper", &fields::upper, upper, s * c},
            {"to_x", &fields::to_x, to_x, s * n * d},
            {"to_v", &fields::to_v, to_v, s * n * d},
            {"offset", &fields::offset, offset, s * n},
            {"from_x", &fields::from_x, from_x, s * d * n},
            {"from_v", &fields::from_v, from_v, s * d * n},
            {"particular", &fields::particular, particular, s * d * 2 * lines}};
        if (dense_) {
            parts.push_back({"b", &fields::b, of_flow("b"), s * d * d});
            parts.push_back({"constant", &fields::constant, of_flow("constant"), s * d});
        } else {
            parts.push_back({"k", &fields::k, of_flow("k"), s * d / 2});
            parts.push_back({"c", &fields::c, of_flow("c"), s * d / 2});
            parts.push_back({"a", &fields::a, of_flow("a"), s * d / 2});
        }
        data_.add(parts);
        codes_.push_back(code);
        sides_.insert(sides_.end(), side.begin(), side.end());
        b.codes = codes_.data();
        b.side = sides_.data();
        b.modes = static_cast<long long>(codes_.size());
    }

    nb::dict run(const indices& system, const array& position, const array& velocity,
                 const array& phases, const array& settle, const array& observe, long most_impacts,
                 const nb::dict& observers) const {
        if (codes_.empty()) throw std::invalid_argument("the batch has no mode yet.");
        const std::size_t count = system.size();
        const auto [s, n, lines, c, d] = sizes();
        const std::vector<int> systems(system.data(), system.data() + count);
        for (int one : systems)
            if (one < 0 || static_cast<std::size_t>(one) >= s)
                throw std::invalid_argument("system: an index outside the batch.");
        owned_arrays here;
        here.view = data_.view;
        here.view.members = static_cast<long long>(count);
        here.view.system = systems.data();
        here.view.most_impacts = most_impacts;
        here.add({{"position", &fields::position, position, count * n},
                  {"velocity", &fields::velocity, velocity, count * n},
                  {"phases", &fields::phases, phases, count * lines},
                  {"settle", &fields::settle, settle, count},
                  {"observe", &fields::observe, observe, count}});
        observer_reader(observers, here).read();
        results out(observers, here.view);
        const auto ask = interrupted_here();
        {
            const nb::gil_scoped_release release;
            const bool small = d == 6 && lines == 1 && c == 1;
            (dense_ ? run_dense : small ? run_modal_small : run_modal)(here.view, ask);
        }
        raise_if_interrupted();
        return out.to_python();
    }

private:
    // Systems; coordinates, forcing lines, contacts and entries of y of each.
    struct counts {
        std::size_t systems, degrees, lines, contacts, dimension;
    };
    counts sizes() const {
        const auto size = [](long long x) { return static_cast<std::size_t>(x); };
        const auto& b = data_.view;
        return {size(b.systems), size(b.degrees), size(b.lines), size(b.contacts),
                size(2 * (b.degrees + b.lines))};
    }

    bool dense_;
    owned_arrays data_{};
    std::vector<int> codes_, sides_;
};

} // namespace

void bind_batch(nb::module_& m) {
    nb::class_<batch>(
        m, "Batch",
        "Systems of one structure with different numbers, and the members that run in "
        "them.\n\nArrays are C-contiguous float64 with a leading axis of systems, or of "
        "members; they\nare copied. What they mean: see hybrid.Compiled, which gives "
        "System the same for one.")
        .def(nb::init<bool, int, const array&, const array&, const array&, const array&,
                      const array&, const array&, const array&>(),
             "dense"_a, "degrees"_a, "omegas"_a, "kappas"_a, "steps"_a, "impulse"_a, "mobility"_a,
             "shift"_a, "restitution"_a,
             nb::sig("def __init__(self, *, dense: bool, degrees: int, "
                     "omegas: numpy.typing.NDArray[numpy.float64], "
                     "kappas: numpy.typing.NDArray[numpy.float64], "
                     "steps: numpy.typing.NDArray[numpy.float64], "
                     "impulse: numpy.typing.NDArray[numpy.float64], "
                     "mobility: numpy.typing.NDArray[numpy.float64], "
                     "shift: numpy.typing.NDArray[numpy.float64], "
                     "restitution: numpy.typing.NDArray[numpy.float64]) -> None"))
        .def("add_mode", &batch::add_mode, "code"_a, "flow"_a, "rows"_a, "gains"_a, "lower"_a,
             "upper"_a, "side"_a, "to_x"_a, "to_v"_a, "offset"_a, "from_x"_a, "from_v"_a,
             "particular"_a,
             nb::sig("def add_mode(self, *, code: int, "
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
                     "particular: numpy.typing.NDArray[numpy.float64]) -> None"))
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
