// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/ceilings_cuda.h"

#include "kernels/ceilings/ceilings_cuda.h"
#include "runtime/cuda/device/cuda_device.h"
#include "runtime/cuda/device/device_buffer.h"

#include <algorithm>
#include <limits>

namespace gsc {

namespace {

// size of the copied buffer: twenty times the second-level cache of an H200
constexpr size_t kLargestBuffer = size_t(1) << 30;
constexpr int kLeastRuns = 5;
// length of each measurement, enough for the device to reach the clocks that it has under load
constexpr double kSpanMs = 40;

size_t bufferBytes(uint64_t most_bytes)
{
    size_t free_bytes = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&free_bytes, &total));
    const size_t bytes =
        std::min<size_t>({kLargestBuffer, free_bytes / 8, most_bytes / 2}) / kCeilingPieceBytes * kCeilingPieceBytes;
    if (bytes == 0)
        throw Error(ErrorCode::OutOfMemory, "cuda", formatString("%zu bytes of device memory are free", free_bytes),
                    formatString("%zu to measure it with", 8 * kCeilingPieceBytes), "end what else uses the GPU");
    return bytes;
}

} // namespace

DeviceCeilings measureCudaCeilings(uint32_t processors, uint64_t most_bytes)
{
    const CudaStream stream;
    const CudaEvent start, end;
    // seconds of the fastest of many runs of `launch`
    const auto best = [&](const auto& launch) {
        launch(); // the first launch warms the device up and is not measured
        double least = std::numeric_limits<double>::infinity(), spent = 0;
        for (int run = 0; run < kLeastRuns || spent < kSpanMs; ++run) {
            start.record(stream);
            launch();
            end.record(stream);
            GSC_CUDA_CHECK(cudaEventSynchronize(end.handle));
            // note: the device's clock may read 0 for a very short interval
            const double ms = std::max(end.since(start), 1e-4);
            least = std::min(least, ms);
            spent += ms;
        }
        return least / 1000;
    };
    DeviceCeilings found;
    MemoryBudget budget; // a budget of its own, all of which is freed at the end
    DeviceArena sink_memory(budget), source_memory(budget), target_memory(budget);
    sink_memory.reserve(sizeof(uint32_t), "a measurement");
    auto* const sink = reinterpret_cast<uint32_t*>(sink_memory.get());
    const size_t bytes = bufferBytes(most_bytes);
    source_memory.reserve(bytes, "a measurement");
    target_memory.reserve(bytes, "a measurement");
    unsigned char *const source = source_memory.get(), *const target = target_memory.get();
    fillCuda(source, bytes, stream.handle);
    const double ours = best([&] { copyCuda(source, target, bytes, stream.handle); });
    const double drivers =
        best([&] { GSC_CUDA_CHECK(cudaMemcpyAsync(target, source, bytes, cudaMemcpyDeviceToDevice, stream.handle)); });
    found.copy_bytes_per_s = 2 * double(bytes) / std::min(ours, drivers);
    found.read_bytes_per_s = double(bytes) / best([&] { readCuda(source, bytes, sink, stream.handle); });
    const auto rate = [&](double (*launch)(uint32_t, uint32_t*, CUstream_st*)) {
        double work = 0;
        const double seconds = best([&] { work = launch(processors, sink, stream.handle); });
        return work / seconds;
    };
    found.fma_lane_ops_per_s = rate(fmaCuda);
    found.exp_per_s = rate(expCuda);
    found.mma_flop_per_s = rate(mmaCuda);
    return found;
}

} // namespace gsc
