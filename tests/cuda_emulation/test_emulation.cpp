// SPDX-License-Identifier: Apache-2.0
// The emulation itself: its arithmetic, and that it stops at what a GPU would pass over.
#include "kernels/cuda/ptx.cuh"
#include "runtime/cuda/device/device_buffer.h"
#include "tests/cuda_emulation/address_sanitizer.h"

#include <cuda_runtime.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#include <doctest/doctest.h>

namespace {

template <typename... Parameters>
void launch(uint32_t blocks, uint32_t threads, size_t shared, void (*kernel)(Parameters...), Parameters... arguments)
{
    cudaLaunchConfig_t config{};
    config.gridDim = dim3(blocks);
    config.blockDim = dim3(threads);
    config.dynamicSmemBytes = shared;
    REQUIRE(cudaLaunchKernelEx(&config, kernel, arguments...) == cudaSuccess);
}

// Does the process die of it? Its words are thrown away.
template <typename Body>
bool dies(Body body)
{
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
        std::signal(SIGABRT, SIG_DFL); // not doctest's
        if (std::freopen("/dev/null", "w", stderr) == nullptr)
            _exit(0);
        body();
        _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    return !WIFEXITED(status) || WEXITSTATUS(status) != 0;
}

__global__ void multiplyKernel(const uint16_t* left, const uint16_t* right, float* product)
{
    const uint32_t lane = threadIdx.x, g = lane / 4, t = lane % 4;
    const auto pair = [](uint32_t low, uint32_t high) { return low | high << 16; };
    const auto rowPair = [&](uint32_t row, uint32_t k) { return pair(left[row * 16 + k], left[row * 16 + k + 1]); };
    const auto columnPair = [&](uint32_t k) { return pair(right[k * 8 + g], right[(k + 1) * 8 + g]); };
    const uint32_t a[4] = {rowPair(g, 2 * t), rowPair(g + 8, 2 * t), rowPair(g, 2 * t + 8), rowPair(g + 8, 2 * t + 8)};
    float d[4];
    for (uint32_t i = 0; i < 4; ++i)
        d[i] = product[(g + 8 * (i / 2)) * 8 + 2 * t + i % 2];
    gsc::mmaM16N8K16(d, a, {columnPair(2 * t), columnPair(2 * t + 8)});
    for (uint32_t i = 0; i < 4; ++i)
        product[(g + 8 * (i / 2)) * 8 + 2 * t + i % 2] = d[i];
}

// Finds the value that a thread of another warp wrote, with and without a barrier between.
__global__ void neighbourKernel(uint32_t* found, bool synchronised)
{
    auto* values = reinterpret_cast<uint32_t*>(gsc_emulation::dynamicShared());
    values[threadIdx.x] = threadIdx.x;
    if (synchronised)
        __syncthreads();
    found[threadIdx.x] = values[threadIdx.x ^ 32];
}

__global__ void votesKernel(uint32_t* out)
{
    const uint32_t lane = threadIdx.x & 31u;
    const bool even = lane % 2 == 0;
    const uint32_t half = __ballot_sync(~0u, even);
    uint32_t sum = 0;
    if (even) // half of a warp apart from the other
        sum = __reduce_add_sync(half, lane) + __shfl_sync(half, lane, 30);
    __syncwarp();
    out[threadIdx.x] = sum + uint32_t(__popc(__match_any_sync(~0u, lane / 4))) * 1000;
}

__global__ void exitedLaneKernel()
{
    if (threadIdx.x == 3)
        return;
    __syncwarp();
}
__global__ void mixedIntrinsicsKernel()
{
    if (threadIdx.x < 16)
        __ballot_sync(~0u, true);
    else
        __any_sync(~0u, true);
}
__global__ void lostBarrierKernel()
{
    if (threadIdx.x < 32)
        __syncthreads();
}
__global__ void crossedBarriersKernel()
{
    gsc::barrierSync(threadIdx.x < 32 ? 1 : 2, 64);
}
__global__ void strangersShuffleKernel()
{
    if (threadIdx.x < 16)
        __shfl_sync(0xffffu, 1u, 20);
}

#ifdef GSC_POISONS
__global__ void overrunKernel(unsigned char* data, size_t at)
{
    data[at] = 1;
}
__global__ void sharedOverrunKernel(size_t at)
{
    gsc_emulation::dynamicShared()[at] = 1;
}
#endif

} // namespace

TEST_CASE("emulation: halves and floats, every half and what lies between two")
{
    using namespace gsc_emulation;
    for (uint32_t h = 0; h < 0x10000; ++h) {
        const float v = floatOfHalf(uint16_t(h));
        if (!(v == v)) {
            CHECK((halfOfFloat(v) & 0x7fffu) > 0x7c00u);
            continue;
        }
        REQUIRE(halfOfFloat(v) == h);
        if ((h & 0x7fffu) >= 0x7bffu)
            continue;
        const float next = floatOfHalf(uint16_t(h + 1)), middle = 0.5f * (v + next);
        REQUIRE(halfOfFloat(middle) == h + (h & 1u)); // to even
        REQUIRE(halfOfFloat(std::nextafter(middle, v)) == h);
        REQUIRE(halfOfFloat(std::nextafter(middle, next)) == h + 1);
    }
    CHECK(halfOfFloat(65519.0f) == 0x7bff);
    CHECK(halfOfFloat(65520.0f) == 0x7c00);
    CHECK(floatOfHalf(0x3555) == doctest::Approx(1.0 / 3).epsilon(1e-3));
    CHECK(gsc::halvesRelu(-1.0f, 1.0f) == 0x3c000000u);
    CHECK((gsc::halvesRelu(NAN, 0.0f) & 0x7fffu) > 0x7c00u);
    CHECK(gsc::exp2Approx(-126.0f) == 0x1p-126f);
    CHECK(gsc::exp2Approx(-126.5f) == 0.0f);
}

TEST_CASE("emulation: a product of matrices through the fragments of a warp")
{
    std::vector<uint16_t> left(16 * 16), right(16 * 8);
    std::vector<float> product(16 * 8), want(16 * 8);
    for (size_t i = 0; i < left.size(); ++i)
        left[i] = gsc_emulation::halfOfFloat(float(int(i * 7 % 23) - 11));
    for (size_t i = 0; i < right.size(); ++i)
        right[i] = gsc_emulation::halfOfFloat(float(int(i * 5 % 19) - 9));
    for (uint32_t i = 0; i < 16 * 8; ++i) {
        want[i] = product[i] = float(i);
        for (uint32_t k = 0; k < 16; ++k)
            want[i] += float(int((i / 8 * 16 + k) * 7 % 23) - 11) * float(int((k * 8 + i % 8) * 5 % 19) - 9);
    }
    launch<const uint16_t*, const uint16_t*, float*>(1, 32, 0, multiplyKernel, left.data(), right.data(),
                                                     product.data());
    CHECK(product == want);
}

TEST_CASE("emulation: votes of half a warp")
{
    std::vector<uint32_t> out(96);
    launch<uint32_t*>(1, 96, 0, votesKernel, out.data());
    for (uint32_t i = 0; i < out.size(); ++i)
        CHECK(out[i] == (i % 2 == 0 ? 240u + 30u : 0u) + 4000u);
}

TEST_CASE("emulation: a missing barrier shows in some order of the threads")
{
    uint32_t wrong = 0;
    for (uint32_t turn = 0; turn < 20; ++turn)
        for (const bool synchronised : {true, false}) {
            std::vector<uint32_t> found(64, 7);
            launch<uint32_t*, bool>(1, 64, 64 * sizeof(uint32_t), neighbourKernel, found.data(), synchronised);
            for (uint32_t i = 0; i < 64; ++i) {
                if (synchronised)
                    REQUIRE(found[i] == (i ^ 32));
                wrong += found[i] == ~0u; // the poison
            }
        }
    CHECK(wrong > 0);
}

TEST_CASE("emulation: behind every piece of an arena is room that is nobody's")
{
    gsc::ArenaLayout counted(nullptr);
    counted.take<char>(1);
    CHECK(counted.bytes() == 512);
}

TEST_CASE("emulation: what CUDA leaves undefined ends the program")
{
    CHECK(!dies([] {
        launch<>(
            1, 64, 0, +[] { __syncthreads(); });
    }));
    CHECK(dies([] { launch<>(1, 32, 0, exitedLaneKernel); }));
    CHECK(dies([] { launch<>(1, 32, 0, mixedIntrinsicsKernel); }));
    CHECK(dies([] { launch<>(1, 64, 0, lostBarrierKernel); }));
    CHECK(dies([] { launch<>(1, 64, 0, crossedBarriersKernel); }));
    CHECK(dies([] { launch<>(1, 32, 0, strangersShuffleKernel); }));
}

#ifdef GSC_POISONS
TEST_CASE("emulation: AddressSanitizer sees what kernels do outside their memory")
{
    void* data = nullptr;
    REQUIRE(cudaMalloc(&data, 1000) == cudaSuccess);
    auto* const bytes = static_cast<unsigned char*>(data);
    gsc_emulation::handOut(bytes, 100, 512); // a piece of it
    for (const size_t at : {size_t(99), size_t(512), size_t(999)})
        CHECK(!dies([=] { launch<unsigned char*, size_t>(1, 1, 0, overrunKernel, bytes, at); }));
    for (const size_t at : {size_t(100), size_t(511), size_t(1000)})
        CHECK(dies([=] { launch<unsigned char*, size_t>(1, 1, 0, overrunKernel, bytes, at); }));
    CHECK(!dies([] { launch<size_t>(1, 64, 300, sharedOverrunKernel, 299); }));
    CHECK(dies([] { launch<size_t>(1, 64, 300, sharedOverrunKernel, 300); }));
    cudaFree(data);
    CHECK(dies([=] { launch<unsigned char*, size_t>(1, 1, 0, overrunKernel, bytes, 0); }));
}
#endif

TEST_CASE("emulation: a captured kernel keeps its arguments, and a launch takes those last set")
{
    cudaStream_t stream = nullptr;
    cudaGraph_t graph = nullptr;
    cudaGraphExec_t exec = nullptr;
    uint32_t* data = nullptr;
    REQUIRE(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking) == cudaSuccess);
    REQUIRE(cudaMalloc(reinterpret_cast<void**>(&data), sizeof(uint32_t)) == cudaSuccess);
    CHECK(*data == ~0u);
    REQUIRE(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal) == cudaSuccess);
    REQUIRE(cudaMemsetAsync(data, 0, sizeof(uint32_t), stream) == cudaSuccess);
    cudaLaunchConfig_t config{};
    config.stream = stream;
    config.gridDim = dim3(3);
    void (*add)(uint32_t*, uint32_t) = [](uint32_t* to, uint32_t v) { atomicAdd(to, v); };
    REQUIRE(cudaLaunchKernelEx(&config, add, data, 5u) == cudaSuccess);
    cudaStreamCaptureStatus status{};
    const cudaGraphNode_t* nodes = nullptr;
    size_t count = 0;
    REQUIRE(cudaStreamGetCaptureInfo(stream, &status, nullptr, nullptr, &nodes, nullptr, &count) == cudaSuccess);
    REQUIRE(count == 1);
    const cudaGraphNode_t node = nodes[0];
    void* none = nullptr;
    CHECK(cudaMalloc(&none, 16) == cudaErrorStreamCaptureUnsupported);
    CHECK(cudaStreamSynchronize(stream) == cudaErrorStreamCaptureUnsupported);
    REQUIRE(cudaStreamEndCapture(stream, &graph) == cudaSuccess);
    CHECK(*data == ~0u); // nothing has run
    REQUIRE(cudaGraphInstantiate(&exec, graph, 0) == cudaSuccess);
    REQUIRE(cudaGraphLaunch(exec, stream) == cudaSuccess);
    CHECK(*data == 15);
    cudaKernelNodeParams params{};
    REQUIRE(cudaGraphKernelNodeGetParams(node, &params) == cudaSuccess);
    CHECK(*static_cast<uint32_t*>(params.kernelParams[1]) == 5);
    uint32_t seven = 7;
    void* list[] = {&data, &seven};
    params.kernelParams = list;
    REQUIRE(cudaGraphExecKernelNodeSetParams(exec, node, &params) == cudaSuccess);
    seven = 1000; // copied
    REQUIRE(cudaGraphLaunch(exec, stream) == cudaSuccess);
    CHECK(*data == 21);
    REQUIRE(cudaGraphKernelNodeGetParams(node, &params) == cudaSuccess);
    CHECK(*static_cast<uint32_t*>(params.kernelParams[1]) == 5); // the graph's own
    cudaGraphExecDestroy(exec);
    cudaGraphDestroy(graph);
    CHECK(cudaFree(data) == cudaSuccess);
    cudaStreamDestroy(stream);
    (void)cudaGetLastError();
}
