// A batch as plain arrays: many systems of one structure, the members that run in them, and where
// results go. A host owns the arrays and lends them to the kernel.
#pragma once

#include "vibroimpact/numeric/config.hpp"

namespace vi {

struct batch_arrays {
    // sizes
    long long systems;
    long long modes;
    long long members;
    long long degrees;
    long long lines;
    long long contacts;
    long long mixed; // whether positions show q' of blocks in free flight

    // systems: what _kernel.Batch is told of one, leading axis the systems
    const double* omegas;
    const double* kappas;
    const double* steps;
    const double* impulse;
    const double* mobility;
    const double* shift;
    const double* restitution;

    // modes: what add_mode is told of one system, leading axes (mode, system); the free mode is first
    const int* codes; // (mode)
    const int* side;  // (mode, contact)
    const double* k;
    const double* c;
    const double* a;
    const double* b; // of dense flows, in place of k, c, a
    const double* constant;
    const double* norm;
    const double* growth;
    const double* rows;
    const double* gains;
    const double* lower;
    const double* upper;
    const double* to_x;
    const double* to_v;
    const double* offset;
    const double* from_x;
    const double* from_v;
    const double* particular;

    // members
    const int* system;
    const double* position;
    const double* velocity;
    const double* phases;
    const double* settle;
    const double* observe;
    long long most_impacts;

    // observers: observer_bit, and options (sweeps/observers/observer.py)
    long long wanted;
    long long contact;
    long long stop;
    long long last;
    long long stride;
    long long strobe_last;
    double strobe_at; // phase
    double symbol_tolerance;
    long long symbol_returns;
    double settling_tolerance;
    long long settling_returns;
    long long longest;
    long long rotation_contact;
    long long rotation_stop;
    long long rotation_stride;
    double rotation_tolerance;
    long long extremes_count;
    const double* extremes_rows;
    long long averages_count;
    const double* averages_rows;
    long long exponents;

    // results, leading axis the members; null where they are not wanted
    signed char* end;
    double* time;
    double* section_position;
    double* section_velocity;
    double* section_phase;
    double* section_time;
    double* strobe_position;
    double* strobe_velocity;
    double* strobe_phase;
    double* strobe_time;
    double* symbol;
    double* impacts;
    double* speeds;
    double* power;
    double* settling;
    double* extremes;
    double* averages;
    double* shares;
    double* counts;
    double* rotation;
    double* lyapunov;
    double* spectrum;
    double* final_position;
    double* final_velocity;
    double* final_phase;
};

} // namespace vi
