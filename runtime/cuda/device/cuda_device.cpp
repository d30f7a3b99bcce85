// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/device/cuda_device.h"

#include "kernels/upload/upload_cuda.h"
#include "runtime/cuda/device/cuda_devices.h"
#include "runtime/cuda/device/nvml.h"

#include <map>
#include <mutex>
#include <optional>
#include <utility>

namespace gsc {

namespace {

// Facts of a device that hold for the whole process.
struct Known {
    std::optional<uint64_t> used_before;   // bytes in use on the device before this process had a context
    std::optional<uint64_t> context_bytes; // result of CudaDevice::contextBytes()
    int holders = 0;
    bool lost = false;
    std::mutex starts; // locked while the device starts or is reset, which may take long
};

std::mutex s_mutex; // guards the variables below
std::map<int, Known> s_known;

std::string versionText(int version)
{
    return formatString("%d.%d", version / 1000, version % 1000 / 10);
}

// Returns the memory in use on the device by all processes, in bytes; 0 = unknown.
uint64_t usedBytes(int ordinal)
{
    char bus[32] = {};
    return cudaDeviceGetPCIBusId(bus, sizeof(bus), ordinal) == cudaSuccess ? nvmlFacts(bus).used_bytes : 0;
}

// Measures the memory that the context of this process took, right after it was made.
void noteContext(int ordinal)
{
    // most bytes that a context takes; if more were taken, another process took them
    constexpr uint64_t kMost = 2ull << 30;
    // memory for the code of kernels, which are loaded only at their first launch
    constexpr uint64_t kCode = 32ull << 20;
    const uint64_t now = usedBytes(ordinal);
    const std::lock_guard lock(s_mutex);
    Known& known = s_known[ordinal];
    const uint64_t before = known.used_before.value_or(0);
    if (!known.context_bytes)
        known.context_bytes = before == 0 || now < before || now - before > kMost ? 0 : now - before + kCode;
}

// Makes a device this thread's, with a context that runs this build's code. The first call for a device measures the
// memory in use before the context is made.
cudaError_t start(int ordinal)
{
    std::mutex* starts = nullptr;
    {
        const std::lock_guard lock(s_mutex);
        Known& known = s_known[ordinal];
        if (!known.used_before)
            known.used_before = usedBytes(ordinal);
        starts = &known.starts;
    }
    const std::lock_guard lock(*starts);
    cudaError_t code = cudaSetDevice(ordinal);
    if (code == cudaSuccess)
        code = cudaError_t(probeCuda());
    if (code == cudaSuccess)
        noteContext(ordinal);
    return code;
}

} // namespace

int cudaDeviceCount()
{
    int count = 0;
    const cudaError_t code = cudaGetDeviceCount(&count);
    (void)cudaGetLastError();
    return code == cudaSuccess ? count : 0;
}

DeviceInfo lookAtCudaDevice(int ordinal)
{
    const auto unusable = [&](ErrorCode code, const std::string& found, const std::string& expected,
                              std::string remedy) {
        (void)cudaGetLastError();
        remedy += (remedy.empty() ? "" : ", or ") + std::string("draw on the CPU");
        Error fault = Error(code, "cuda", found, expected, remedy).with({Setting::CpuBackend});
        std::string text = fault.withoutSubject();
        return DeviceInfo{{"cuda", ordinal}, false, std::move(fault), std::move(text)};
    };
    int runtime = 0, driver = 0, count = 0;
    (void)cudaRuntimeGetVersion(&runtime);
    (void)cudaDriverGetVersion(&driver); // note: gives 0 and no error if there is no driver
    if (driver == 0)
        return unusable(ErrorCode::Device, "no NVIDIA driver", "one for CUDA " + versionText(runtime), "install it");
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code == cudaErrorInsufficientDriver)
        return unusable(ErrorCode::Device, "the NVIDIA driver knows CUDA " + versionText(driver),
                        versionText(runtime) + " or later", "update the driver");
    if (code == cudaErrorNoDevice || (code == cudaSuccess && count == 0))
        return unusable(ErrorCode::Device, "no NVIDIA GPU is visible", "one", "look at CUDA_VISIBLE_DEVICES");
    cudaDeviceProp properties{};
    if (code == cudaSuccess)
        code = cudaGetDeviceProperties(&properties, ordinal);
    if (code == cudaSuccess)
        code = start(ordinal);
    if (isUnsupportedDevice(code))
        return unusable(ErrorCode::Unsupported,
                        formatString("%s has compute capability %d.%d and driver %s, for which this build has no code",
                                     properties.name, properties.major, properties.minor, versionText(driver).c_str()),
                        "8.0 or later and a driver for CUDA " + versionText(runtime),
                        formatString("build with CMAKE_CUDA_ARCHITECTURES=%d%d", properties.major, properties.minor));
    if (code != cudaSuccess)
        return unusable(
            ErrorCode::Device,
            formatString("the device does not start: %s (%s)", cudaGetErrorString(code), cudaGetErrorName(code)),
            "success", "");
    return {{"cuda", ordinal},
            true,
            {},
            formatString("%s, %.1f GiB, compute capability %d.%d, %d multiprocessors, driver for CUDA %s",
                         properties.name, double(properties.totalGlobalMem) / double(1 << 30), properties.major,
                         properties.minor, properties.multiProcessorCount, versionText(driver).c_str()),
            properties.name,
            properties.totalGlobalMem};
}

CudaDevice::CudaDevice(int ordinal) : m_ordinal(ordinal)
{
    const DeviceInfo found = lookAtCudaDevice(ordinal);
    if (!found.usable)
        throw *found.fault;
    cudaDeviceProp properties{};
    GSC_CUDA_CHECK(cudaGetDeviceProperties(&properties, ordinal));
    m_limits = {uint32_t(properties.multiProcessorCount), properties.sharedMemPerBlockOptin};
    const std::lock_guard lock(s_mutex);
    ++s_known[ordinal].holders;
}

CudaDevice::~CudaDevice()
{
    std::mutex* starts = nullptr;
    {
        const std::lock_guard lock(s_mutex);
        Known& known = s_known[m_ordinal];
        if (--known.holders > 0 || !std::exchange(known.lost, false))
            return;
        starts = &known.starts;
    }
    const std::lock_guard lock(*starts); // the lock is of this device alone, so other devices can start meanwhile
    // errors of a lost device stay with its context, and go when that is reset
    if (cudaSetDevice(m_ordinal) != cudaSuccess || cudaDeviceSynchronize() != cudaSuccess) {
        (void)cudaDeviceReset();
        (void)cudaGetLastError();
    }
}

void CudaDevice::noteLost() const
{
    const std::lock_guard lock(s_mutex);
    s_known[m_ordinal].lost = true;
}

DeviceFacts CudaDevice::facts() const
{
    cudaDeviceProp properties{};
    char bus[32] = {};
    GSC_CUDA_CHECK(cudaGetDeviceProperties(&properties, m_ordinal));
    GSC_CUDA_CHECK(cudaDeviceGetPCIBusId(bus, sizeof(bus), m_ordinal));
    const NvmlFacts nvml = nvmlFacts(bus);
    return {properties.name,
            nvml.driver,
            properties.totalGlobalMem,
            uint32_t(properties.multiProcessorCount),
            nvml.clock_mhz,
            nvml.memory_clock_mhz,
            contextBytes()};
}

uint64_t CudaDevice::contextBytes() const
{
    const std::lock_guard lock(s_mutex);
    return s_known[m_ordinal].context_bytes.value_or(0);
}

} // namespace gsc
