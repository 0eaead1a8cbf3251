// The kernels of a device: one thread per mode of a system, then one per member.
//
// VI_DIMENSION, VI_LINES, VI_CONTACTS   sizes of the batch
// VI_MIXED                              whether positions show q' of blocks: 0 or 1
// VI_TANGENTS                           tangent vectors carried along, 0 for none
// VI_OBSERVERS                          mask of the observers that are wanted
#include "vibroimpact/ensemble/run_member.hpp"

using flow = vi::modal_flow<double, vi::fixed<VI_DIMENSION, VI_LINES, VI_CONTACTS, VI_MIXED != 0>>;

__device__ inline long long thread_number() {
    return static_cast<long long>(blockIdx.x) * blockDim.x + threadIdx.x;
}

extern "C" __global__ void entry_sizes(long long* out) {
    if (thread_number() == 0) vi::sizes_of_entries<flow>(out);
}

extern "C" __global__ void build(const vi::batch_arrays* batch) {
    const long long i = thread_number(), mode = i % batch->modes, system = i / batch->modes;
    if (system >= batch->systems) return;
    const auto room = vi::room_of_system<flow>(*batch, system);
    if (mode == 0) vi::build_system(*batch, system, room);
    vi::build_mode(*batch, mode, system, room);
}

extern "C" __global__ void run(const vi::batch_arrays* batch) {
    const long long i = thread_number();
    if (i < batch->members) vi::run_member<flow, VI_TANGENTS>(*batch, i);
}
