// SPDX-License-Identifier: Apache-2.0
#include "kernels/decode/fast/decode_kernel.cuh"

namespace gsc {

uint32_t decodeFastGaps(uint32_t processors, uint32_t slot_capacity)
{
    return processors * kMostDecodeWarps * slotPiece(slot_capacity);
}

void decodeFastCuda(const DecodeCudaArgs& args, uint32_t processors, size_t shared_bytes, CUstream_st* stream)
{
    args.model.compact_shape != nullptr ? decodeCompactCuda(args, processors, shared_bytes, stream)
                                        : launchDecode<false>(args, processors, shared_bytes, stream);
}

} // namespace gsc
