// The kernel as the explorer's page calls it: recorded compilations repeated, runs, sections, symbols.
//
// Method      A recording (src/vibroimpact/explorer/recording.py) is what Python did to compile a machine. repeat() does it
//             again for other parameters; the numbers that come out are the arrays of ensemble/arrays.hpp. build() makes
//             the system of them, as a batch of one.
// Assumes     one thread; the page reserves memory, fills it, and gives none back
// Accuracy    the bits of Python (engine of the same headers, equal flags); of sin, cos, exp, log and powers other
//             than squares a last digit may differ

#include <cstdlib>
#include <new>

#include "decouple/decouple.hpp"
#include "vibroimpact/engine/start.hpp"
#include "vibroimpact/ensemble/build.hpp"
#include "vibroimpact/flow/dense.hpp"
#include "vibroimpact/flow/modal.hpp"
#include "vibroimpact/system/pace.hpp"

#define EXPORT(name) extern "C" __attribute__((export_name(#name)))

extern unsigned char __heap_base; // the linker's

namespace {

// ---- memory --------------------------------------------------------------------------------------

constexpr unsigned page_bytes = 65536;
unsigned used = 0;

void* reserved(unsigned bytes) {
    if (used == 0) used = reinterpret_cast<unsigned>(&__heap_base);
    const unsigned at = (used + 63u) & ~63u, end = at + bytes;
    const unsigned pages = static_cast<unsigned>(__builtin_wasm_memory_size(0));
    if (end > pages * page_bytes)
        __builtin_wasm_memory_grow(0, (end - pages * page_bytes + page_bytes - 1) / page_bytes);
    used = end;
    return reinterpret_cast<void*>(at);
}

// What src/decouple takes while it works, which is given back at its end.
unsigned heap = 0, heap_used = 0;
constexpr unsigned heap_bytes = 1u << 20;

} // namespace

void* operator new(std::size_t bytes) {
    if (heap == 0) heap = reinterpret_cast<unsigned>(reserved(heap_bytes));
    const unsigned at = (heap_used + 15u) & ~15u;
    if (at + bytes > heap_bytes) __builtin_trap();
    heap_used = at + static_cast<unsigned>(bytes);
    return reinterpret_cast<void*>(heap + at);
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    return operator new(bytes);
}
void operator delete(void*) noexcept {}
void operator delete(void*, std::size_t) noexcept {}
void operator delete(void*, const std::nothrow_t&) noexcept {}
namespace std {
inline namespace __1 { // of libc++, where a length is impossible: NOLINT
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) noexcept {
    __builtin_trap();
}
} // namespace __1
} // namespace std

namespace {

// ---- recordings ----------------------------------------------------------------------------------

// As web/src/kernel.ts lays it out: whole numbers and addresses of 32 bits.
struct recording {
    int inputs, constants, operations, conditions, patches;
    double* entries;     // inputs, constants, results
    const int* code;     // of each operation its number and three operands
    const int* lists;    // entries of matrices
    double* tables;      // what decouple has found
    const int* required; // of each condition an entry, and the truth that it must have
    const int* patched;  // of each patch a place among the numbers, and an entry
    double* numbers;     // of the system: arrays in the order of arrays_of()
    int dense, mixed, piecewise, sequential, degrees, lines, contacts, elements, resets, parts,
        modes;
    const int *codes, *side, *states, *soft, *joint;
    const int *watch_counts, *watch_element, *watch_held, *watch_reset;
};

enum operation : int { // OPERATIONS of recording.py
    add,
    subtract,
    multiply,
    divide,
    negative,
    absolute,
    root,
    less,
    less_equal,
    greater,
    greater_equal,
    equal,
    not_equal,
    finite,
    infinite,
    where,
    copysign_of,
    mantissa,
    exponent,
    floor_of,
    ldexp_of,
    sine,
    cosine,
    exponential,
    logarithm,
    power,
    decouple_blocks,
    taken
};

struct parts_of_number { // x = mantissa 2^exponent, 1/2 <= |mantissa| < 1
    double mantissa;
    int exponent;
};
parts_of_number parts_of(double x) {
    if (!(vi::abs(x) > 0.0) || !(vi::abs(x) < vi::infinity())) return {x, 0};
    int more = 0;
    if (vi::abs(x) < 0x1p-1000) {
        x *= 0x1p64;
        more = -64;
    }
    auto bits = __builtin_bit_cast(unsigned long long, x);
    const int e = static_cast<int>(bits >> 52 & 0x7ff) - 1022;
    bits = (bits & ~(0x7ffULL << 52)) | (1022ULL << 52);
    return {__builtin_bit_cast(double, bits), e + more};
}
double two_to(int e) {
    return __builtin_bit_cast(double, static_cast<unsigned long long>(e + 1023) << 52);
}
double scaled(double x, int e) {
    for (; e > 1000; e -= 1000)
        x *= 0x1p1000;
    for (; e < -1000; e += 1000)
        x *= 0x1p-1000;
    return x * two_to(e);
}

double result_of(int what, double x, double y, double z) {
    switch (what) {
    case add:
        return x + y;
    case subtract:
        return x - y;
    case multiply:
        return x * y;
    case divide:
        return x / y;
    case negative:
        return -x;
    case absolute:
        return vi::abs(x);
    case root:
        return __builtin_sqrt(x);
    case less:
        return x < y;
    case less_equal:
        return x <= y;
    case greater:
        return x > y;
    case greater_equal:
        return x >= y;
    case equal:
        return x == y;
    case not_equal:
        return x != y;
    case finite:
        return vi::abs(x) < vi::infinity();
    case infinite:
        return vi::abs(x) == vi::infinity();
    case where:
        return x != 0.0 ? y : z;
    case copysign_of:
        return __builtin_copysign(x, y);
    case mantissa:
        return parts_of(x).mantissa;
    case exponent:
        return parts_of(x).exponent;
    case floor_of:
        return __builtin_floor(x);
    case ldexp_of:
        return scaled(x, static_cast<int>(y));
    case sine:
        return vi::sincos(x).s;
    case cosine:
        return vi::sincos(x).c;
    case exponential:
        return vi::exp(x);
    case logarithm:
        return vi::log(x);
    default:
        return y == 2.0 ? x * x : vi::exp(y * vi::log(x));
    }
}

// Blocks of coupled systems of unit masses, from stiffness and damping: k, c, positions, velocities, back, in the order of
// _kernel.decouple. Whether there are any.
double decoupled_into(const double* e, const int* list, int size, double* out) {
    heap_used = 0;
    const auto n = static_cast<std::size_t>(size);
    vi::square_matrix halves[2] = {vi::square_matrix(n), vi::square_matrix(n)};
    for (auto& half : halves)
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < n; ++j)
                half(i, j) = e[*list++];
    const auto d = vi::decouple({halves[0], halves[1]});
    if (!d.found) return 0.0;
    for (const auto& one : d.blocks)
        *out++ = one.k;
    for (const auto& one : d.blocks)
        *out++ = one.c;
    for (std::size_t first : {std::size_t{0}, n})
        for (std::size_t i = 0; i < n; ++i)
            for (const auto& one : d.blocks)
                *out++ = one.shape[first + i];
    for (std::size_t i = 0; i < 2 * n; ++i)
        for (std::size_t j = 0; j < 2 * n; ++j)
            *out++ = d.back[i][j];
    return 1.0;
}

// ---- systems -------------------------------------------------------------------------------------

// Takes arrays from where they stand one after the other.
struct cursor {
    const double* at;
    const double* take(int count) {
        const double* here = at;
        at += count;
        return here;
    }
};

vi::batch_arrays arrays_of(const recording& r) {
    vi::batch_arrays b{};
    const int n = r.degrees, d = 2 * (n + r.lines), m = r.modes, c = r.contacts;
    b.systems = b.members = 1;
    b.modes = m;
    b.degrees = n;
    b.lines = r.lines;
    b.contacts = c;
    b.elements = r.elements;
    b.mixed = r.mixed;
    b.resets = r.resets;
    b.together = r.sequential ? vi::impact_law::sequential : vi::impact_law::moreau;
    b.states = r.states;
    b.soft = r.soft;
    b.joint = r.joint;
    b.codes = r.codes;
    b.side = r.side;
    cursor from{r.numbers + 2 + r.parts * (n + 5)}; // those of the pace come first
    b.omegas = from.take(r.lines);
    b.kappas = from.take(r.lines);
    b.steps = from.take(1);
    b.impulse = from.take(c * d);
    b.mobility = from.take(c * c);
    b.shift = from.take(c * d);
    b.restitution = from.take(2 * c);
    b.reset_shift = from.take(r.resets * d);
    if (r.dense) {
        b.b = from.take(m * d * d);
        b.constant = from.take(m * d);
        b.norm = from.take(m * d * d);
        b.growth = from.take(m);
    } else {
        b.k = from.take(m * d / 2);
        b.c = from.take(m * d / 2);
        b.a = from.take(m * d / 2);
    }
    b.rows = from.take(m * c * d);
    b.gains = from.take(m * c);
    b.lower = from.take(m * c);
    b.upper = from.take(m * c);
    b.to_x = from.take(m * n * d);
    b.to_v = from.take(m * n * d);
    b.offset = from.take(m * n);
    b.from_x = from.take(m * d * n);
    b.from_v = from.take(m * d * n);
    b.particular = from.take(m * d * 2 * r.lines);
    if (!r.piecewise) return b;
    int watches = 0;
    for (int i = 0; i < m; ++i)
        watches += r.watch_counts[i];
    b.watch_counts = r.watch_counts;
    b.watch_element = r.watch_element;
    b.watch_held = r.watch_held;
    b.watch_reset = r.watch_reset;
    b.mode_steps = from.take(m);
    b.map_shift = from.take(m * d);
    b.watch_rows = from.take(watches * d);
    b.watch_gains = from.take(watches);
    b.watch_lower = from.take(watches);
    b.watch_upper = from.take(watches);
    b.element_rows = from.take(m * 2 * r.elements * (d + 1));
    return b;
}

int wanted = 0, why = 0; // of the latest call: code of a mode that is missing, reason of the end

// What of an event is written: numbers of a row.
constexpr int head = 9; // status, contact, side, mode, time (2), rates before and after, phase

template <class Flow>
struct machine {
    using Shape = typename Flow::shape_type;
    using map_type = typename vi::hybrid<Flow>::map_type;
    static constexpr int D = Flow::max_dimension;

    vi::batch_arrays b{};
    vi::hybrid<Flow> system{};
    vi::mode<double, Flow>* modes = nullptr;
    map_type *from_free = nullptr, *to_free = nullptr, *resets = nullptr;
    int room = 0;
    vi::trajectory<double, Shape> at{};
    vi::clock now{};

    int dimension() const { return system.dimension(); }
    vi::mode_coordinates map(int mode) const { return vi::coordinates_of(b, mode, 0); }

    void build(const recording& r) {
        b = arrays_of(r);
        if (r.modes > room || !resets) {
            room = r.modes;
            modes = static_cast<vi::mode<double, Flow>*>(
                reserved(static_cast<unsigned>(sizeof(vi::mode<double, Flow>)) * room));
            from_free = static_cast<map_type*>(reserved(sizeof(map_type) * room));
            to_free = static_cast<map_type*>(reserved(sizeof(map_type) * room));
            resets = static_cast<map_type*>(reserved(sizeof(map_type) * 2 * vi::most_elements));
        }
        const vi::system_room<Flow> in{&system, modes, from_free, to_free, resets, nullptr, 0};
        system = {};
        vi::build_system(b, 0, in);
        for (int m = 0; m < r.modes; ++m) {
            ::new (static_cast<void*>(&modes[m])) vi::mode<double, Flow>;
            vi::build_mode(b, m, 0, in);
        }
    }

    int begin(const double* x, const double* v, const double* phases) {
        at = {};
        now = {};
        vi::start_at(system, map(0), x, v, phases, at);
        if (vi::behind_stop(system, at)) return -1;
        if constexpr (Shape::max_elements > 0) {
            const auto states = vi::settle_elements(system, at);
            if (states.what == vi::decision::missing) {
                wanted = states.code;
                return -2;
            }
        }
        return at.mode;
    }

    template <class Observer>
    void go_on(double t_max, double flight_limit, int events, int impacts, Observer& see) {
        const auto end = vi::run(system, at, now, {t_max, flight_limit, events, impacts}, see);
        why = static_cast<int>(end.why);
        wanted = end.code;
    }

    void put_place(double*& out, int mode, const vi::vec<double, D>& y) const {
        const auto p = map(mode);
        for (int i = 0; i < p.degrees; ++i)
            *out++ = vi::position_of(p, i, y, dimension());
    }
    void put_speed(double*& out, int mode, const vi::vec<double, D>& y) const {
        const auto p = map(mode);
        for (int i = 0; i < p.degrees; ++i)
            *out++ = vi::velocity_of(p, i, y, dimension());
    }

    struct recorder {
        machine& of;
        double* out;
        int count = 0;
        int mode; // whose coordinates the state before the event has, as of the bindings' recorder

        bool see(const vi::event<double, Shape>& e, const vi::trajectory<double, Shape>& to,
                 const vi::clock& time) {
            const double row[head] = {static_cast<double>(e.what),
                                      static_cast<double>(e.contact),
                                      static_cast<double>(e.side),
                                      static_cast<double>(to.mode),
                                      time.high,
                                      time.low,
                                      e.rate_before,
                                      e.rate_after,
                                      of.b.lines ? vi::phase_of(of.map(0), 0, to.y, of.dimension())
                                                 : 0.0};
            for (const double x : row)
                *out++ = x;
            of.put_place(out, to.mode, to.y);
            of.put_speed(out, mode, e.before);
            of.put_speed(out, to.mode, to.y);
            for (int i = 0; i < of.dimension(); ++i)
                *out++ = to.y[i];
            if (of.b.elements > 0) mode = to.mode;
            ++count;
            return true;
        }
    };
    int record(double t_max, double flight_limit, int events, int impacts, double* out) {
        recorder see{*this, out, 0, b.elements > 0 ? at.mode : 0};
        go_on(t_max, flight_limit, events, impacts, see);
        return see.count;
    }

    // States after impacts at one contact and side: phase, speed of the impact, x, v. Side 0: either.
    struct sectioned {
        machine& of;
        double* out;
        int contact, side, room, count = 0;

        bool see(const vi::event<double, Shape>& e, const vi::trajectory<double, Shape>& to,
                 const vi::clock&) {
            if (!vi::counts_as_impact(e.what) || e.contact != contact ||
                (side != 0 && e.side != side))
                return true;
            *out++ = of.b.lines ? vi::phase_of(of.map(0), 0, to.y, of.dimension()) : 0.0;
            *out++ = -e.rate_before;
            of.put_place(out, to.mode, to.y);
            of.put_speed(out, to.mode, to.y);
            return ++count < room;
        }
    };
    int section(int contact, int side, int room, double t_max, int events, double* out) {
        sectioned see{*this, out, contact, side, room};
        go_on(t_max, vi::infinity(), events, events, see);
        return see.count;
    }

    // The symbol of the motion after a time, as the observer of sweeps has it: n, p of all stops, q of all.
    struct looker {
        machine& of;
        double settle;
        typename vi::observe::symbol::template observer<Flow>& symbol;
        int impacts = 0;

        bool see(const vi::event<double, Shape>& e, const vi::trajectory<double, Shape>& to,
                 const vi::clock& now) {
            if (now.time() < settle) return true;
            impacts += vi::counts_as_impact(e.what);
            symbol.on_event({of.system, e, to, now.time()});
            return true;
        }
    };
    int symbol(double settle, double observe, int impacts, double tolerance, int returns,
               double phase, double* out) {
        static typename vi::observe::symbol::template observer<Flow> seen;
        seen = {};
        vi::observe::symbol options;
        options.tolerance = tolerance;
        options.returns = returns;
        const double omega = b.lines ? b.omegas[0] : 0.0;
        seen.prepare(options,
                     vi::member_start<Flow>{
                         settle, observe, omega, phase, b.steps[0], map(0), {}, {}, nullptr});
        looker see{*this, settle, seen};
        go_on(settle + observe, vi::infinity(), 4 * impacts + 64, impacts, see);
        const auto found = seen.result();
        const int stops = static_cast<int>(b.contacts + b.elements);
        *out++ = see.impacts;
        *out++ = found.n;
        for (int i = 0; i < stops; ++i)
            *out++ = found.p[i];
        for (int i = 0; i < stops; ++i)
            *out++ = found.q[i];
        return why;
    }

    void evaluate(int mode, const double* from, double dt, double* out) const {
        vi::vec<double, D> y{};
        for (int i = 0; i < dimension(); ++i)
            y[i] = from[i];
        const auto then = modes[mode].flow.flight(y, dt);
        put_place(out, mode, then);
        put_speed(out, mode, then);
    }
    void state(double* out) const {
        for (int i = 0; i < dimension(); ++i)
            *out++ = at.y[i];
    }
};

using modal_small = vi::modal_flow<double, vi::fixed<6, 1, 1>>;
using modal = vi::modal_flow<double, vi::any_size>;
using dense_small = vi::dense_flow<double, vi::shape<8, 0, 2, false, false, 2>>;
using dense = vi::dense_flow<double, vi::any_elements>;

machine<modal_small> of_modal_small;
machine<modal> of_modal;
machine<dense_small> of_dense_small;
machine<dense> of_dense;
int kind = 0;

template <class Visit>
auto with_machine(const Visit& visit) {
    switch (kind) {
    case 0:
        return visit(of_modal_small);
    case 1:
        return visit(of_modal);
    case 2:
        return visit(of_dense_small);
    default:
        return visit(of_dense);
    }
}

int kind_of(const recording& r) {
    const int d = 2 * (r.degrees + r.lines);
    if (!r.dense) return d == 6 && r.lines == 1 && r.contacts == 1 && !r.mixed ? 0 : 1;
    return d <= 8 && r.contacts <= 2 && r.elements <= 2 ? 2 : 3;
}

} // namespace

// Whether fma rounds once: the instruction of relaxed SIMD does so on some processors only.
EXPORT(fused) int fused(double x) { // 2^-30
    return vi::fma(1.0 + x, 1.0 + x, -1.0 - 2.0 * x) == x * x;
}

EXPORT(reserve) void* reserve(int bytes) {
    return reserved(static_cast<unsigned>(bytes));
}

// Repeat a recording. -1: done; else the number of the condition that fails.
EXPORT(repeat) int repeat(const recording* r, const double* inputs) {
    double* e = r->entries;
    for (int i = 0; i < r->inputs; ++i)
        e[i] = inputs[i];
    const int first = r->inputs + r->constants;
    for (int i = 0; i < r->operations; ++i) {
        const int* one = r->code + 4 * i;
        if (one[0] == decouple_blocks)
            e[first + i] = decoupled_into(e, r->lists + one[2], one[1], r->tables + one[3]);
        else if (one[0] == taken)
            e[first + i] = r->tables[one[2]];
        else
            e[first + i] = result_of(one[0], e[one[1]], e[one[2]], e[one[3]]);
    }
    for (int i = 0; i < r->conditions; ++i)
        if ((e[r->required[2 * i]] != 0.0) != (r->required[2 * i + 1] != 0)) return i;
    for (int i = 0; i < r->patches; ++i)
        r->numbers[r->patched[2 * i]] = e[r->patched[2 * i + 1]];
    return -1;
}

// Pace of the run of some length from a start (system/pace.hpp), of a recording that was repeated.
EXPORT(pace_of)
double pace_of(const recording* r, const double* x, const double* v, double run, double slowest,
               double fastest) {
    const int n = r->degrees;
    const double own = r->numbers[0], most = r->numbers[1];
    vi::paces all;
    double size = 0.0;
    for (int j = 0; j < n; ++j)
        size = vi::max(size, vi::abs(x[j]));
    for (int p = 0; p < r->parts; ++p) {
        const double* row = r->numbers + 2 + p * (n + 5);
        all.add({row, row[n], row[n + 1], row[n + 2], row[n + 3], row[n + 4]}, x, v, n);
    }
    const double found =
        vi::searchable(all.beside(own, size, run, r->piecewise ? run : 0.0), slowest, fastest);
    return found > most ? found : 0.0;
}

// Make the system of a recording that was repeated. Its arrays stay where they are.
EXPORT(build) void build(const recording* r) {
    kind = kind_of(*r);
    with_machine([&](auto& m) { m.build(*r); });
}

// Begin at a state. The mode; -1: behind a stop; -2: a mode is missing.
EXPORT(begin) int begin(const double* x, const double* v, const double* phases) {
    return with_machine([&](auto& m) { return m.begin(x, v, phases); });
}
EXPORT(record) int record(double t_max, double flight_limit, int events, int impacts, double* out) {
    return with_machine(
        [&](auto& m) { return m.record(t_max, flight_limit, events, impacts, out); });
}
EXPORT(section)
int section(int contact, int side, int room, double t_max, int events, double* out) {
    return with_machine(
        [&](auto& m) { return m.section(contact, side, room, t_max, events, out); });
}
EXPORT(symbol)
int symbol(double settle, double observe, int impacts, double tolerance, int returns, double phase,
           double* out) {
    return with_machine([&](auto& m) {
        return m.symbol(settle, observe, impacts, tolerance, returns, phase, out);
    });
}
EXPORT(evaluate) void evaluate(int mode, const double* y, double dt, double* out) {
    with_machine([&](auto& m) { m.evaluate(mode, y, dt, out); });
}
EXPORT(state) void state(double* out) {
    with_machine([&](auto& m) { m.state(out); });
}
EXPORT(step_of) double step_of() {
    return with_machine([&](auto& m) { return m.b.steps[0]; });
}
EXPORT(reason) int reason() {
    return why;
}
EXPORT(missing) int missing() {
    return wanted;
}
