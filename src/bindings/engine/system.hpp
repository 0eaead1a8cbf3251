// A compiled hybrid system of any shape, as Python sees it.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace binding {

using numbers = std::vector<double>;

struct contact_data {
    numbers impulse, mobility, shift;
    double restitution[2]; // lower, upper
};

struct guard_data {
    numbers row;
    double gain, lower, upper;
    int side;
};

struct watch_data {
    guard_data guard;
    int element;
    bool held;
    int reset, target; // -1: none
};

// Row-major matrices; see hybrid.py for what they mean.
struct mode_data {
    int code;
    double step;
    numbers k, c, a;           // modal
    numbers b, constant, norm; // dense
    double growth;
    std::vector<guard_data> guards;
    std::vector<watch_data> watches; // of elements
    numbers to_x, to_v, offset, from_x, from_v, particular, shift;
};

struct system_data {
    int dimension, degrees;
    bool mixed; // of a modal flow: whether positions show q' of blocks in free flight
    numbers omegas, kappas;
    double step;
    std::vector<contact_data> contacts;
    std::vector<int> states; // which each element has, as bits
    std::vector<bool> soft;  // which elements are soft stops
    std::vector<bool> joint; // which act on massless coordinates
    bool given = false;      // whether watches give the mode that follows
    bool sequential = false; // whether contacts that touch strike one after the other
};

// A trajectory as plain numbers, so that a run can be continued.
struct position {
    numbers y;
    int mode = 0, held = 0;
    numbers touching, rate, flat;
    double high = 0.0, low = 0.0; // clock
    int states = 0;               // code of the states of elements, and what belongs to it
    bool settled = false;
    int due = 0;
    double size = 0.0;
    std::vector<int> zeros{};
    numbers offset{};
};

struct start_data {
    numbers x, v, phases;
};

struct start_result {
    position at;
    numbers gap_lower, gap_upper, eps;
};

struct limits_data {
    double t_max, flight_limit;
    long events, impacts;
    bool (*interrupted)() = nullptr; // asked now and then; true ends the run
};

// One row per event; state rows are y in the mode that follows, x_v rows are physical.
struct record {
    std::vector<int> status, contact, side, mode;
    numbers high, low, y, before, after, phase, rate_before, rate_after;
    int why = 0, code = 0;
};

struct progress {
    int why, code;
    long events;
};

struct tangent_result {
    numbers columns;   // d(x, v, theta_1..) after the last event, one column per seed, row-major
    numbers durations; // d(time of the last event), one per seed
    int events = 0, why = 0, code = 0;
};

struct lyapunov_result {
    numbers growth, time; // log growth and elapsed time, one per block of events
    long events = 0;
    int why = 0, code = 0;
};

class system {
public:
    virtual ~system() = default;
    virtual void add_mode(const mode_data& data) = 0;
    // A map y -> matrix y + shift that watches name by its number, row-major. Returns the number.
    virtual int add_reset(const numbers& matrix, const numbers& shift) = 0;
    virtual start_result start(const start_data& data) const = 0;
    // Decide the states of elements: 0, the code of a mode that this takes, or -1 where none can last.
    virtual int settle(position& at) const = 0;
    virtual record simulate(position& at, const limits_data& limits) const = 0;
    // Runs without a record, for settling and timing. Returns the reason, the code and the events seen.
    virtual progress advance(position& at, const limits_data& limits) const = 0;
    // Evaluate flights: y[i] in mode[i] after dt[i], as x, v rows; fewer where it is interrupted.
    virtual numbers evaluate(const std::vector<int>& mode, const numbers& y, const numbers& dt,
                             bool (*interrupted)()) const = 0;
    // Derivatives of the run in the physical directions (dx, dv, dtheta) of the start.
    virtual tangent_result tangents(const start_data& start, const numbers& seeds, int count,
                                    const limits_data& limits) const = 0;
    virtual lyapunov_result lyapunov(const position& at, const limits_data& limits,
                                     long block) const = 0;
    // Growths of several tangents, at most tangent_width of the flow, which stand together.
    virtual lyapunov_result spectrum(const position& at, const limits_data& limits, long block,
                                     int count) const = 0;
    // Free mode: accelerations at (x, v, phases); the flow after dt as a matrix; the impact matrix.
    virtual numbers acceleration(const start_data& state) const = 0;
    virtual numbers flow_matrix(double dt) const = 0;
    virtual numbers impact_matrix(int contact, int side) const = 0;
};

std::unique_ptr<system> make_modal_small(const system_data& data);
std::unique_ptr<system> make_modal(const system_data& data);
std::unique_ptr<system> make_dense_small(const system_data& data);
std::unique_ptr<system> make_dense(const system_data& data);

} // namespace binding
