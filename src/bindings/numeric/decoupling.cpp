#include "numeric/decoupling_module.hpp"

#include <stdexcept>

#include "arrays.hpp"
#include "decouple/decouple.hpp"

using namespace nanobind::literals;

namespace binding {

namespace {

// Blocks of every system, in turn; zeros where there are none.
struct tables {
    std::size_t n;
    std::vector<double> found, k, c, positions, velocities, back;

    tables(std::size_t systems, std::size_t degrees)
        : n(degrees), found(systems), k(systems * n), c(systems * n), positions(systems * n * n),
          velocities(systems * n * n), back(systems * 4 * n * n) {}

    void put(std::size_t s, const vi::decoupled& d) {
        if (!d.found) return;
        found[s] = 1.0;
        for (std::size_t j = 0; j < n; ++j) {
            k[s * n + j] = d.blocks[j].k;
            c[s * n + j] = d.blocks[j].c;
            for (std::size_t i = 0; i < n; ++i) {
                positions[(s * n + i) * n + j] = d.blocks[j].shape[i];
                velocities[(s * n + i) * n + j] = d.blocks[j].shape[n + i];
            }
        }
        for (std::size_t i = 0; i < 2 * n; ++i)
            for (std::size_t j = 0; j < 2 * n; ++j)
                back[(s * 2 * n + i) * 2 * n + j] = d.back[i][j];
    }
};

vi::square_matrix matrix_at(const double* entries, std::size_t n) {
    vi::square_matrix out(n);
    for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j)
            out(i, j) = entries[i * n + j];
    return out;
}

nb::object decouple(const array& stiffness, const array& damping) {
    if (stiffness.ndim() != 3 || stiffness.shape(1) != stiffness.shape(2) ||
        damping.size() != stiffness.size())
        throw std::invalid_argument("stiffness and damping must have the shape (S, n, n).");
    const std::size_t systems = stiffness.shape(0), n = stiffness.shape(1);
    const double *first = stiffness.data(), *second = damping.data();
    tables out(systems, n);
    {
        const nb::gil_scoped_release release;
        for (std::size_t s = 0; s < systems; ++s) {
            const std::size_t at = s * n * n;
            out.put(s, vi::decouple({matrix_at(first + at, n), matrix_at(second + at, n)}));
        }
    }
    nb::dict parts;
    parts["found"] = to_numpy(std::move(out.found), {systems});
    parts["k"] = to_numpy(std::move(out.k), {systems, n});
    parts["c"] = to_numpy(std::move(out.c), {systems, n});
    parts["positions"] = to_numpy(std::move(out.positions), {systems, n, n});
    parts["velocities"] = to_numpy(std::move(out.velocities), {systems, n, n});
    parts["back"] = to_numpy(std::move(out.back), {systems, 2 * n, 2 * n});
    return std::move(parts);
}

} // namespace

void bind_decoupling(nb::module_& m) {
    m.def("decouple", &decouple, "stiffness"_a, "damping"_a,
          "Second-order blocks of x'' + D x' + A x = 0 for S systems, D and A symmetric, (S, n, n)."
          "\n\nReturns k and c of the blocks q'' = -k q - c q', (S, n); x = positions q + "
          "velocities q',\n(S, n, n); (q_1, q_1', q_2, ...) = back (x, x'), (S, 2n, 2n); found, "
          "(S), 0 where there are none\nto rounding, the rest being zero.",
          nb::sig("def decouple(stiffness: numpy.typing.NDArray[numpy.float64], "
                  "damping: numpy.typing.NDArray[numpy.float64]) "
                  "-> dict[str, numpy.typing.NDArray[numpy.float64]]"));
}

} // namespace binding
