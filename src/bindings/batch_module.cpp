#include "batch_module.hpp"

#include <stdexcept>
#include <string>

#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "batch.hpp"
#include "interrupt.hpp"
#include "vibroimpact/ensemble.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace binding {

namespace {

using indices = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

// The numbers of an array that must have so many.
numbers checked(const char* name, const array& a, std::size_t size) {
    if (a.size() != size)
        throw std::invalid_argument(std::string(name) + " has " + std::to_string(a.size()) +
                                    " numbers; expected " + std::to_string(size) + ".");
    return numbers_of(a);
}

class batch {
public:
    batch(bool dense, int degrees, const array& omegas, const array& kappas, const array& steps,
          const array& impulse, const array& mobility, const array& shift,
          const array& restitution) {
        if (omegas.ndim() != 2 || impulse.ndim() != 3)
            throw std::invalid_argument("omegas must have 2 axes (S, L), impulse 3 (S, C, D).");
        data_.dense = dense;
        data_.count = omegas.shape(0);
        data_.degrees = static_cast<std::size_t>(degrees);
        data_.lines = omegas.shape(1);
        data_.dimension = 2 * (data_.degrees + data_.lines);
        data_.contacts = impulse.shape(1);
        const std::size_t s = data_.count, c = data_.contacts, d = data_.dimension;
        const bool fits = d <= 32 && c >= 1 && c <= 8 && data_.lines <= vi::max_lines;
        if (s == 0 || degrees < 1 || !fits)
            throw std::invalid_argument("a batch needs at least one system, and sizes that fit.");
        data_.omegas = numbers_of(omegas);
        data_.kappas = checked("kappas", kappas, s * data_.lines);
        data_.steps = checked("steps", steps, s);
        data_.impulse = checked("impulse", impulse, s * c * d);
        data_.mobility = checked("mobility", mobility, s * c * c);
        data_.shift = checked("shift", shift, s * c * d);
        data_.restitution = checked("restitution", restitution, s * c * 2);
    }

    void add_mode(int code, const nb::dict& flow, const array& rows, const array& gains,
                  const array& lower, const array& upper, std::vector<int> side, const array& to_x,
                  const array& to_v, const array& offset, const array& from_x, const array& from_v,
                  const array& particular) {
        const std::size_t s = data_.count, c = data_.contacts, d = data_.dimension;
        const std::size_t n = data_.degrees;
        const auto part = [&](const char* name, std::size_t size) {
            return checked(name, nb::cast<array>(flow[name]), size);
        };
        batch_mode mode{};
        mode.code = code;
        if (data_.dense) {
            mode.b = part("b", s * d * d);
            mode.constant = part("constant", s * d);
        } else {
            mode.k = part("k", s * d / 2);
            mode.c = part("c", s * d / 2);
            mode.a = part("a", s * d / 2);
        }
        mode.rows = checked("rows", rows, s * c * d);
        mode.gains = checked("gains", gains, s * c);
        mode.lower = checked("lower", lower, s * c);
        mode.upper = checked("upper", upper, s * c);
        if (side.size() != c || (data_.modes.empty() && code != 0))
            throw std::invalid_argument("side: one per contact; the free mode, code 0, is first.");
        mode.side = std::move(side);
        mode.to_x = checked("to_x", to_x, s * n * d);
        mode.to_v = checked("to_v", to_v, s * n * d);
        mode.offset = checked("offset", offset, s * n);
        mode.from_x = checked("from_x", from_x, s * d * n);
        mode.from_v = checked("from_v", from_v, s * d * n);
        mode.particular = checked("particular", particular, s * d * 2 * data_.lines);
        data_.modes.push_back(std::move(mode));
    }

    nb::dict run(const indices& system, const array& position, const array& velocity,
                 const array& phases, const array& settle, const array& observe, long most_impacts,
                 const nb::dict& observers) const {
        if (data_.modes.empty()) throw std::invalid_argument("the batch has no mode yet.");
        const std::size_t count = system.size();
        const members all{{system.data(), system.data() + count},
                          checked("position", position, count * data_.degrees),
                          checked("velocity", velocity, count * data_.degrees),
                          checked("phases", phases, count * data_.lines),
                          checked("settle", settle, count),
                          checked("observe", observe, count),
                          most_impacts,
                          interrupted};
        for (std::int32_t s : all.system)
            if (s < 0 || static_cast<std::size_t>(s) >= data_.count)
                throw std::invalid_argument("system: an index outside the batch.");
        const auto options = read(observers);
        auto out = [&] {
            const nb::gil_scoped_release release;
            const bool small = data_.dimension == 6 && data_.lines == 1 && data_.contacts == 1;
            return data_.dense ? run_dense(data_, all, options)
                   : small     ? run_modal_small(data_, all, options)
                               : run_modal(data_, all, options);
        }();
        raise_if_interrupted();
        nb::dict result;
        result["end"] = to_numpy(std::move(out.end), {count});
        out.each([&](table& t) {
            if (t.width) result[t.name] = to_numpy(std::move(t.values), {count, t.width});
        });
        return result;
    }

private:
    // What ensembles/observers.py writes.
    observer_options read(const nb::dict& spec) const {
        observer_options o;
        const auto option = [&](const char* observer, const char* name) {
            return nb::cast<nb::dict>(spec[observer])[name];
        };
        const auto number = [&](const char* observer, const char* name) {
            return nb::cast<double>(option(observer, name));
        };
        const auto whole = [&](const char* observer, const char* name) {
            const long value = nb::cast<long>(option(observer, name));
            if (value < 0) throw std::invalid_argument(std::string(name) + ": must be >= 0.");
            return value;
        };
        const auto at_least_one = [&](const char* observer, const char* name) {
            return std::max(whole(observer, name), 1L);
        };
        const auto wanted = [&](const char* observer, unsigned bit) {
            if (spec.contains(observer)) o.wanted |= bit;
            return spec.contains(observer);
        };
        if (wanted("section", vi::sees_section)) {
            o.contact = static_cast<int>(whole("section", "contact"));
            o.side = nb::cast<int>(option("section", "side"));
            o.last = at_least_one("section", "last");
            o.stride = at_least_one("section", "stride");
        }
        if (wanted("symbol", vi::sees_symbol)) {
            o.symbol_tolerance = number("symbol", "tolerance");
            o.symbol_returns = at_least_one("symbol", "returns");
        }
        if (wanted("settling", vi::sees_settling)) {
            o.settling_tolerance = number("settling", "tolerance");
            o.settling_returns = at_least_one("settling", "returns");
            o.longest = at_least_one("settling", "longest");
        }
        wanted("impacts", vi::sees_impacts);
        wanted("speeds", vi::sees_speeds);
        wanted("power", vi::sees_power);
        wanted("shares", vi::sees_shares);
        if (wanted("extremes", vi::sees_extremes)) o.extremes = rows(spec["extremes"]);
        if (wanted("averages", vi::sees_averages)) o.averages = rows(spec["averages"]);
        o.lyapunov = spec.contains("lyapunov");
        o.spectrum = spec.contains("spectrum");
        o.final_state = spec.contains("final");
        return o;
    }

    // Rows on the coordinates; an empty one stands for a row for every coordinate.
    numbers rows(nb::handle given) const {
        const std::size_t n = data_.degrees;
        numbers out;
        for (nb::handle one : given) {
            auto row = nb::cast<numbers>(one);
            if (!row.empty() && row.size() != n)
                throw std::invalid_argument("row: one number per coordinate, or none.");
            for (std::size_t i = 0; row.empty() && i < n * n; ++i)
                out.push_back(i % (n + 1) == 0 ? 1.0 : 0.0);
            out.insert(out.end(), row.begin(), row.end());
        }
        if (out.size() > n * vi::most_watched)
            throw std::invalid_argument("rows: at most 16 of one observer.");
        return out;
    }

    batch_data data_{};
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
