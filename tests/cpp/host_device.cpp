// The kernels of a device on the processor, one thread after the other: the same source, so that
// everything but the card can be tested.
#define __global__
#define __device__
namespace {
struct place {
    unsigned x;
};
place threadIdx{0}, blockIdx{0}, blockDim{1};
} // namespace

#include "kernels.cu"

namespace {

template <class Argument>
void launch(void (*kernel)(Argument*), void* argument, unsigned threads) {
    for (blockIdx.x = 0; blockIdx.x < threads; ++blockIdx.x)
        kernel(static_cast<Argument*>(argument));
}

} // namespace

extern "C" void launch_entry_sizes(void* argument, unsigned threads) {
    launch(entry_sizes, argument, threads);
}
extern "C" void launch_build(void* argument, unsigned threads) {
    launch(build, argument, threads);
}
extern "C" void launch_run(void* argument, unsigned threads) {
    launch(run, argument, threads);
}
