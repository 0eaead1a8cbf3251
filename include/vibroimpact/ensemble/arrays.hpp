// A batch as plain arrays: many systems of one structure, the members that run in them, and where
// results go. A host owns the arrays; the kernel borrows them.
#pragma once

#include "vibroimpact/observe/observers.hpp"

namespace vi {

struct batch_arrays : batch_sizes {
    impact_law together = impact_law::moreau;

    // systems: the arguments of _kernel.Batch for one, leading axis the systems
    const double* omegas;
    const double* kappas;
    const double* steps;
    const double* impulse;
    const double* mobility;
    const double* shift;
    const double* restitution;
    const double* damping;
    // Of elements: which states each has, as bits, whether it is a soft stop, and whether it acts on a massless
    // coordinate, the same for all systems
    const int* states;
    const int* soft;
    const int* joint;
    // Maps of y where watches say so, by the impulses of phase switches and by the resets of hybrid systems, so many
    // of them; without matrices they are unit matrices
    long long resets;
    const double* reset_shift;
    const double* reset_matrix;
    bool given; // whether watches say which mode follows

    // modes: the arguments of add_mode for one system, leading axes (mode, system); the free mode is first
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

    // Modes with elements, null for others: the step of each, the constant of the map into it, watches, all of a
    // mode together, and force and speed of every element, rows on (y, 1).
    const double* mode_steps;
    const double* map_shift;
    const int* watch_counts; // (mode)
    const int* watch_element;
    const int* watch_held;
    const int* watch_reset;
    const int* watch_target; // codes of modes; null: none is given
    const double* watch_rows;
    const double* watch_gains;
    const double* watch_lower;
    const double* watch_upper;
    const double* element_rows;

    // members
    const int* system;
    const double* position;
    const double* velocity;
    const double* phases;
    const double* settle;
    const double* observe;
    long long most_impacts;

    // results, leading axis the members: member_end and the time reached
    signed char* end;
    double* time;

    observer_declarations observers; // options and results
};

} // namespace vi
