// SPDX-License-Identifier: Apache-2.0
// CUDA's runtime without a device: memory, launches, streams and events.
#include "tests/cuda_emulation/stream.h"

#include "tests/cuda_emulation/address_sanitizer.h"
#include "tests/cuda_emulation/block.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>

namespace gsc_emulation {

namespace {

constexpr size_t kMemory = size_t(8) << 30;
constexpr size_t kSharedBytes = 48 << 10, kSharedBytesOptin = 227 << 10; // bytes of a block
constexpr uint32_t kMaxThreads = 1024;
constexpr int kCudaVersion = 13000, kDevices = 2;

std::mutex s_mutex; // guards what follows
std::map<uintptr_t, size_t> s_memory;
std::map<const void*, size_t> s_shared_limit;
size_t s_used = 0;

std::atomic<bool> s_lost = false;
thread_local cudaError_t t_last = cudaSuccess;
thread_local int t_captures = 0;

// Does a range lie within one allocation?
bool onDevice(const void* data, size_t bytes)
{
    const std::lock_guard lock(s_mutex);
    const auto at = reinterpret_cast<uintptr_t>(data);
    const auto after = s_memory.upper_bound(at);
    if (after == s_memory.begin())
        return false;
    const auto& [start, size] = *std::prev(after);
    return at - start <= size && bytes <= size - (at - start);
}

bool touchesDevice(const void* data)
{
    return onDevice(data, 1);
}

} // namespace

void handOut(void* data, size_t bytes, [[maybe_unused]] size_t room)
{
    ASAN_UNPOISON_MEMORY_REGION(data, room);
    std::memset(data, 0xff, bytes);
    ASAN_POISON_MEMORY_REGION(static_cast<char*>(data) + bytes, room - bytes);
}

cudaError_t noted(cudaError_t code)
{
    if (code != cudaSuccess)
        t_last = code;
    return code;
}

bool capturing()
{
    return t_captures != 0;
}

void countCaptures(int change)
{
    t_captures += change;
}

cudaError_t deviceState()
{
    return noted(s_lost ? cudaErrorLaunchFailure : cudaSuccess);
}

void loseDevices()
{
    s_lost = true;
}

cudaError_t runNode(const CUgraphNode_st& node)
{
    if (const cudaError_t code = deviceState(); code != cudaSuccess)
        return code;
    if (node.call == nullptr)
        return node.work();
    runGrid(node.call->grid(), node.call->block(), node.call->sharedBytes(), [&] { node.call->runThread(); });
    return cudaSuccess;
}

cudaError_t enqueue(cudaStream_t stream, CUgraphNode_st node)
{
    if (stream == nullptr || stream->captured == nullptr)
        return noted(runNode(node));
    stream->captured->nodes.push_back(std::make_unique<CUgraphNode_st>(std::move(node)));
    stream->last = stream->captured->nodes.back().get();
    return cudaSuccess;
}

cudaError_t submit(cudaStream_t stream, std::shared_ptr<KernelCall> call)
{
    const dim3 grid = call->grid(), block = call->block();
    if (size_t(grid.x) * grid.y * grid.z == 0 || grid.y > 65535 || grid.z > 65535 || block.x * block.y * block.z == 0 ||
        size_t(block.x) * block.y * block.z > kMaxThreads)
        return noted(cudaErrorInvalidConfiguration);
    size_t limit = kSharedBytes;
    {
        const std::lock_guard lock(s_mutex);
        if (const auto found = s_shared_limit.find(call->function()); found != s_shared_limit.end())
            limit = std::max(limit, found->second);
    }
    if (call->sharedBytes() > limit)
        return noted(cudaErrorInvalidValue);
    return enqueue(stream, {std::move(call), {}});
}

} // namespace gsc_emulation

using namespace gsc_emulation;

cudaError_t cudaGetLastError()
{
    return std::exchange(t_last, cudaSuccess);
}

const char* cudaGetErrorName(cudaError_t code)
{
    switch (code) {
    case cudaSuccess:
        return "cudaSuccess";
    case cudaErrorInvalidValue:
        return "cudaErrorInvalidValue";
    case cudaErrorMemoryAllocation:
        return "cudaErrorMemoryAllocation";
    case cudaErrorInvalidConfiguration:
        return "cudaErrorInvalidConfiguration";
    case cudaErrorInvalidResourceHandle:
        return "cudaErrorInvalidResourceHandle";
    case cudaErrorLaunchFailure:
        return "cudaErrorLaunchFailure";
    case cudaErrorIllegalState:
        return "cudaErrorIllegalState";
    case cudaErrorStreamCaptureUnsupported:
        return "cudaErrorStreamCaptureUnsupported";
    default:
        return "an error of the emulation";
    }
}

const char* cudaGetErrorString(cudaError_t code)
{
    return cudaGetErrorName(code);
}

cudaError_t cudaRuntimeGetVersion(int* version)
{
    *version = kCudaVersion;
    return cudaSuccess;
}

cudaError_t cudaDriverGetVersion(int* version)
{
    *version = kCudaVersion;
    return cudaSuccess;
}

cudaError_t cudaGetDeviceCount(int* count)
{
    *count = kDevices;
    return cudaSuccess;
}

static thread_local int s_device = 0;

cudaError_t cudaSetDevice(int device)
{
    if (device < 0 || device >= kDevices)
        return noted(cudaErrorInvalidDevice);
    s_device = device;
    return cudaSuccess;
}

cudaError_t cudaGetDevice(int* device)
{
    *device = s_device;
    return cudaSuccess;
}

cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device)
{
    if (device < 0 || device >= kDevices)
        return noted(cudaErrorInvalidDevice);
    *properties = {"emulated", kMemory, kSharedBytes, kSharedBytesOptin, 9, 0, 2};
    return cudaSuccess;
}

cudaError_t cudaDeviceSynchronize()
{
    return deviceState();
}

cudaError_t cudaDeviceReset()
{
    s_lost = false;
    return cudaSuccess;
}

cudaError_t cudaDeviceGetPCIBusId(char* id, int bytes, int)
{
    std::snprintf(id, size_t(bytes), "0000:00:00.0");
    return cudaSuccess;
}

cudaError_t cudaFuncGetAttributes(cudaFuncAttributes* attributes, const void*)
{
    attributes->maxThreadsPerBlock = int(kMaxThreads);
    return cudaSuccess;
}

cudaError_t cudaFuncSetAttribute(const void* kernel, cudaFuncAttribute, int value)
{
    if (value < 0 || size_t(value) > kSharedBytesOptin)
        return noted(cudaErrorInvalidValue);
    const std::lock_guard lock(s_mutex);
    s_shared_limit[kernel] = size_t(value);
    return cudaSuccess;
}

cudaError_t cudaMalloc(void** data, size_t bytes)
{
    *data = nullptr;
    if (capturing())
        return noted(cudaErrorStreamCaptureUnsupported);
    if (const cudaError_t code = deviceState(); code != cudaSuccess)
        return code;
    const std::lock_guard lock(s_mutex);
    if (bytes > kMemory - s_used || (bytes != 0 && posix_memalign(data, 256, bytes) != 0))
        return noted(cudaErrorMemoryAllocation);
    if (bytes != 0) {
        std::memset(*data, 0xff, bytes); // NaN, and indices out of all bounds
        s_memory[reinterpret_cast<uintptr_t>(*data)] = bytes;
        s_used += bytes;
    }
    return cudaSuccess;
}

cudaError_t cudaFree(void* data)
{
    if (capturing())
        return noted(cudaErrorStreamCaptureUnsupported);
    if (data == nullptr)
        return cudaSuccess;
    const std::lock_guard lock(s_mutex);
    const auto found = s_memory.find(reinterpret_cast<uintptr_t>(data));
    if (found == s_memory.end())
        return noted(cudaErrorInvalidValue);
    s_used -= found->second;
    ASAN_UNPOISON_MEMORY_REGION(data, found->second);
    s_memory.erase(found);
    std::free(data);
    return cudaSuccess;
}

cudaError_t cudaMallocHost(void** data, size_t bytes)
{
    if (capturing())
        return noted(cudaErrorStreamCaptureUnsupported);
    *data = std::malloc(bytes);
    return *data != nullptr ? cudaSuccess : noted(cudaErrorMemoryAllocation);
}

cudaError_t cudaFreeHost(void* data)
{
    std::free(data);
    return cudaSuccess;
}

cudaError_t cudaHostRegister(void*, size_t, unsigned)
{
    return cudaSuccess;
}

cudaError_t cudaHostUnregister(void*)
{
    return cudaSuccess;
}

cudaError_t cudaMemGetInfo(size_t* left, size_t* total)
{
    if (const cudaError_t code = deviceState(); code != cudaSuccess)
        return code;
    const std::lock_guard lock(s_mutex);
    *left = kMemory - s_used;
    *total = kMemory;
    return cudaSuccess;
}

cudaError_t cudaMemsetAsync(void* data, int value, size_t bytes, cudaStream_t stream)
{
    if (!onDevice(data, bytes))
        return noted(cudaErrorInvalidValue);
    return enqueue(stream, {nullptr, [=] {
                                std::memset(data, value, bytes);
                                return cudaSuccess;
                            }});
}

cudaError_t cudaMemcpyAsync(void* to, const void* from, size_t bytes, cudaMemcpyKind kind, cudaStream_t stream)
{
    const bool to_device = kind != cudaMemcpyDeviceToHost, from_device = kind != cudaMemcpyHostToDevice;
    if ((to_device ? !onDevice(to, bytes) : touchesDevice(to)) ||
        (from_device ? !onDevice(from, bytes) : touchesDevice(from)))
        return noted(cudaErrorInvalidValue);
    return enqueue(stream, {nullptr, [=] {
                                std::memcpy(to, from, bytes);
                                return cudaSuccess;
                            }});
}

cudaError_t cudaMemcpy2DAsync(void* to, size_t to_pitch, const void* from, size_t from_pitch, size_t width,
                              size_t height, cudaMemcpyKind kind, cudaStream_t stream)
{
    for (size_t y = 0; y < height; ++y)
        if (const cudaError_t code =
                cudaMemcpyAsync(static_cast<char*>(to) + y * to_pitch, static_cast<const char*>(from) + y * from_pitch,
                                width, kind, stream);
            code != cudaSuccess)
            return code;
    return cudaSuccess;
}

cudaError_t cudaDeviceCanAccessPeer(int* can, int, int)
{
    *can = 0;
    return cudaSuccess;
}

cudaError_t cudaDeviceGetP2PAttribute(int* value, cudaDeviceP2PAttr, int, int)
{
    *value = 0;
    return cudaSuccess;
}

cudaError_t cudaDeviceEnablePeerAccess(int, unsigned)
{
    return noted(cudaErrorPeerAccessUnsupported);
}

cudaError_t cudaMemcpyPeerAsync(void* to, int, const void* from, int, size_t bytes, cudaStream_t stream)
{
    return cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, stream);
}

cudaError_t cudaMemcpy3DPeerAsync(const cudaMemcpy3DPeerParms* copy, cudaStream_t stream)
{
    return cudaMemcpy2DAsync(copy->dstPtr.ptr, copy->dstPtr.pitch, copy->srcPtr.ptr, copy->srcPtr.pitch,
                             copy->extent.width, copy->extent.height, cudaMemcpyDeviceToDevice, stream);
}

cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned)
{
    *stream = new CUstream_st;
    return cudaSuccess;
}

cudaError_t cudaStreamDestroy(cudaStream_t stream)
{
    delete stream;
    return cudaSuccess;
}

cudaError_t cudaStreamSynchronize(cudaStream_t stream)
{
    if (stream != nullptr && stream->captured != nullptr)
        return noted(cudaErrorStreamCaptureUnsupported);
    return deviceState();
}

cudaError_t cudaEventCreate(cudaEvent_t* event)
{
    *event = new CUevent_st;
    return cudaSuccess;
}

cudaError_t cudaEventQuery(cudaEvent_t)
{
    return deviceState();
}

cudaError_t cudaEventSynchronize(cudaEvent_t)
{
    return deviceState();
}

cudaError_t cudaEventDestroy(cudaEvent_t event)
{
    delete event;
    return cudaSuccess;
}

cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream)
{
    if (stream != nullptr && stream->captured != nullptr) // a dependency, which nothing here needs
        return noted(cudaErrorIllegalState);
    return enqueue(stream, {nullptr, [=] {
                                event->recorded = true;
                                event->at = std::chrono::steady_clock::now();
                                return cudaSuccess;
                            }});
}

cudaError_t cudaEventElapsedTime(float* ms, cudaEvent_t from, cudaEvent_t to)
{
    if (!from->recorded || !to->recorded)
        return noted(cudaErrorInvalidResourceHandle);
    *ms = std::chrono::duration<float, std::milli>(to->at - from->at).count();
    return cudaSuccess;
}
