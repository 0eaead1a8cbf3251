// The measured peak of a device: fused multiplications and additions in doubles.
//
// Method    8 sums x <- a x + b per thread, each waiting only for itself
// Output    their ends, so that none is left out; (threads) doubles
constexpr int chains = 8;
constexpr int steps = 16384;

extern "C" __global__ void peak(double* out) {
    const long long i = static_cast<long long>(blockIdx.x) * blockDim.x + threadIdx.x;
    double x[chains];
    for (int k = 0; k < chains; ++k)
        x[k] = out[i] + k;
    for (int s = 0; s < steps; ++s) {
#pragma unroll
        for (int k = 0; k < chains; ++k)
            x[k] = fma(x[k], 0.999, 0.001);
    }
    for (int k = 1; k < chains; ++k)
        x[0] += x[k];
    out[i] = x[0];
}
