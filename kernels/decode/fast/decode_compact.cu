// SPDX-License-Identifier: Apache-2.0
#include "kernels/decode/fast/decode_kernel.cuh"

namespace gsc {

void decodeCompactCuda(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream)
{
    launchDecode<true>(args, processors, shared_bytes, stream);
}

} // namespace gsc
