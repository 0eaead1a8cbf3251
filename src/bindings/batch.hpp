// Running the members of a batch; one function, and one file, for each shape that is compiled.
#pragma once

#include "vibroimpact/batch/arrays.hpp"

namespace binding {

using question = bool (*)(); // asked now and then; true ends the run

void run_modal_small(const vi::batch_arrays& b, question ask);
void run_modal(const vi::batch_arrays& b, question ask);
void run_dense(const vi::batch_arrays& b, question ask);

} // namespace binding
