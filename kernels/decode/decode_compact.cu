// SPDX-License-Identifier: Apache-2.0
#include "kernels/decode/decode_kernel.cuh"

namespace gsc {

void decodeCompactCuda(const DecodeCudaArgs& args, uint32_t processors, CUstream_st* stream)
{
    launchDecode<true>(args, processors, stream);
}

} // namespace gsc
