// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/ceilings_cuda.h"

#include "kernels/ceilings/ceilings_cuda.h"
#include "runtime/cuda/cuda_device.h"
#include "runtime/cuda/device_buffer.h"

#include <algorithm>
#include <limits>

namespace gsc {

namespace {

constexpr size_t kLargestBuffer = size_t(1) << 30; // twenty times the second-level cache of an H200
constexpr int kLeastRuns = 5;
constexpr double kSpanMs = 40; // of each kind of work: long enough to reach the clocks of a busy device

class Stopwatch {
public:
    explicit Stopwatch(const CudaStream& stream) : m_stream(stream) {}

    // Seconds that the fastest of many runs of `launch` takes.
    template <typename Launch>
    double best(Launch&& launch) const
    {
        launch(); // warm-up
        double best = std::numeric_limits<double>::infinity(), spent = 0;
        for (int run = 0; run < kLeastRuns || spent < kSpanMs; ++run) {
            m_start.record(m_stream);
            launch();
            m_end.record(m_stream);
            GSC_CUDA_CHECK(cudaEventSynchronize(m_end.handle));
            // note: an interval too short for the device's clock reads 0
            const double ms = std::max(m_end.since(m_start), 1e-4);
            best = std::min(best, ms);
            spent += ms;
        }
        return best / 1000;
    }

private:
    const CudaStream& m_stream;
    CudaEvent m_start, m_end;
};

size_t bufferBytes(uint64_t most_bytes)
{
    size_t free_bytes = 0, total = 0;
    GSC_CUDA_CHECK(cudaMemGetInfo(&free_bytes, &total));
    const size_t bytes =
        std::min<size_t>({kLargestBuffer, free_bytes / 8, most_bytes / 2}) / kCeilingPieceBytes * kCeilingPieceBytes;
    if (bytes == 0)
        throw Error(ErrorCode::OutOfMemory, formatString("cuda: %zu bytes of device memory are free, expected %zu to "
                                                         "measure it with; end what else uses the GPU",
                                                         free_bytes, 8 * kCeilingPieceBytes));
    return bytes;
}

} // namespace

DeviceCeilings measureCudaCeilings(uint32_t processors, uint64_t most_bytes)
{
    const CudaStream stream;
    const Stopwatch watch(stream);
    DeviceCeilings found;
    MemoryBudget budget; // of its own: everything is given back at the end
    DeviceArena sink_memory(budget), source_memory(budget), target_memory(budget);
    sink_memory.reserve(sizeof(uint32_t), "a measurement");
    auto* const sink = reinterpret_cast<uint32_t*>(sink_memory.get());
    {
        const size_t bytes = bufferBytes(most_bytes);
        source_memory.reserve(bytes, "a measurement");
        target_memory.reserve(bytes, "a measurement");
        unsigned char *const source = source_memory.get(), *const target = target_memory.get();
        fillCuda(source, bytes, stream.handle);
        const double ours = watch.best([&] { copyCuda(source, target, bytes, stream.handle); });
        const double drivers = watch.best(
            [&] { GSC_CUDA_CHECK(cudaMemcpyAsync(target, source, bytes, cudaMemcpyDeviceToDevice, stream.handle)); });
        found.copy_bytes_per_s = 2 * double(bytes) / std::min(ours, drivers);
        found.read_bytes_per_s = double(bytes) / watch.best([&] { readCuda(source, bytes, sink, stream.handle); });
    }
    const auto rate = [&](double (*launch)(uint32_t, uint32_t*, CUstream_st*)) {
        double work = 0;
        const double seconds = watch.best([&] { work = launch(processors, sink, stream.handle); });
        return work / seconds;
    };
    found.fma_lane_ops_per_s = rate(fmaCuda);
    found.exp_per_s = rate(expCuda);
    found.mma_flop_per_s = rate(mmaCuda);
    return found;
}

} // namespace gsc
