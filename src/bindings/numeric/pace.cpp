#include "numeric/pace_module.hpp"

#include <stdexcept>

#include "arrays.hpp"
#include "vibroimpact/system/pace.hpp"

using namespace nanobind::literals;

namespace binding {

namespace {

using numbers_of_systems = nb::ndarray<const int, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

nb::object pace(const array& parts, const array& own, const array& most,
                const numbers_of_systems& system, const array& position, const array& velocity,
                const array& run, bool elements, double slowest, double fastest) {
    if (parts.ndim() != 3 || position.ndim() != 2 || parts.shape(2) != position.shape(1) + 5 ||
        position.size() != velocity.size() || system.shape(0) != position.shape(0) ||
        most.size() != parts.shape(0) || own.size() != parts.shape(0) ||
        run.size() != position.shape(0))
        throw std::invalid_argument("parts must have the shape (S, P, n + 5), position (N, n).");
    const std::size_t members = position.shape(0), n = position.shape(1), count = parts.shape(1);
    std::vector<double> found(members);
    for (std::size_t i = 0; i < members; ++i) {
        const double *x = position.data() + i * n, *v = velocity.data() + i * n;
        vi::paces all;
        double size = 0.0;
        for (std::size_t j = 0; j < n; ++j)
            size = vi::max(size, vi::abs(x[j]));
        for (std::size_t p = 0; p < count; ++p) {
            const std::size_t which = static_cast<std::size_t>(system(i)) * count + p;
            const double* row = parts.data() + which * (n + 5);
            const vi::paced_part part{row, row[n], row[n + 1], row[n + 2], row[n + 3], row[n + 4]};
            all.add(part, x, v, static_cast<int>(n));
        }
        const double least = most.data()[system(i)], length = run.data()[i];
        const double p = all.beside(own.data()[system(i)], size, length, elements ? length : 0.0);
        const double pace = vi::searchable(p, slowest, fastest);
        found[i] = pace > least ? pace : 0.0;
    }
    return to_numpy(std::move(found), {members});
}

} // namespace

void bind_pace(nb::module_& m) {
    m.def("pace", &pace, "parts"_a, "own"_a, "most"_a, "system"_a, "position"_a, "velocity"_a,
          "run"_a, "elements"_a, "slowest"_a, "fastest"_a,
          "Rate at which each of N motions meets stops or slips, a power of two within slowest and "
          "fastest, (N); "
          "0 where it meets nothing.\n\n"
          "parts, (S, P, n + 5), has for each system and part: row, lower, upper, largest pull, "
          "that of lines, "
          "speed of the belt;\n"
          "own, (S), fastest rates of the systems; most, (S), paces up to which they serve; "
          "system, (N), position "
          "and velocity, (N, n);\n"
          "run, (N), lengths of the runs, which count beside own rates only with elements.",
          nb::sig("def pace(parts: numpy.typing.NDArray[numpy.float64], "
                  "own: numpy.typing.NDArray[numpy.float64], "
                  "most: numpy.typing.NDArray[numpy.float64], "
                  "system: numpy.typing.NDArray[numpy.int32], "
                  "position: numpy.typing.NDArray[numpy.float64], "
                  "velocity: numpy.typing.NDArray[numpy.float64], "
                  "run: numpy.typing.NDArray[numpy.float64], elements: bool, slowest: float, "
                  "fastest: float) "
                  "-> numpy.typing.NDArray[numpy.float64]"));
}

} // namespace binding
