// SPDX-License-Identifier: Apache-2.0
#include "runtime/cuda/cuda_device.h"

#include "kernels/upload/upload_cuda.h"
#include "runtime/cuda/backend_cuda.h"
#include "runtime/cuda/nvml.h"

namespace gsc {

namespace {

constexpr int kDevice = 0; // the first that CUDA_VISIBLE_DEVICES leaves

std::string versionText(int version)
{
    return formatString("%d.%d", version / 1000, version % 1000 / 10);
}

// Memory in use on the device, by all processes; 0 = unknown.
uint64_t usedBytes()
{
    char bus[32] = {};
    return cudaDeviceGetPCIBusId(bus, sizeof(bus), kDevice) == cudaSuccess ? nvmlFacts(bus).used_bytes : 0;
}

// The same before this process had a context. The first call must come before one is made.
uint64_t usedBefore()
{
    static const uint64_t bytes = usedBytes();
    return bytes;
}

CudaStatus failure(ErrorCode code, std::string text)
{
    (void)cudaGetLastError();
    return {false, code, std::move(text)};
}

} // namespace

CudaStatus cudaStatus()
{
    int runtime = 0, driver = 0, count = 0;
    (void)cudaRuntimeGetVersion(&runtime);
    (void)cudaDriverGetVersion(&driver); // note: 0 and no error where there is no driver
    if (driver == 0)
        return failure(ErrorCode::Device, "no NVIDIA driver, expected one for CUDA " + versionText(runtime) +
                                              "; install it or take --backend cpu");
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code == cudaErrorInsufficientDriver)
        return failure(ErrorCode::Device,
                       formatString("the NVIDIA driver knows CUDA %s, expected %s or later; update the driver or take "
                                    "--backend cpu",
                                    versionText(driver).c_str(), versionText(runtime).c_str()));
    if (code == cudaErrorNoDevice || (code == cudaSuccess && count == 0))
        return failure(ErrorCode::Device,
                       "no NVIDIA GPU is visible, expected one; look at CUDA_VISIBLE_DEVICES or take "
                       "--backend cpu");
    cudaDeviceProp properties{};
    (void)usedBefore();
    if (code == cudaSuccess)
        code = cudaSetDevice(kDevice);
    if (code == cudaSuccess)
        code = cudaGetDeviceProperties(&properties, kDevice);
    if (code == cudaSuccess)
        code = cudaError_t(probeCuda());
    if (isUnsupportedDevice(code))
        return failure(ErrorCode::Unsupported,
                       formatString("%s has compute capability %d.%d and driver %s, for which this build has no code, "
                                    "expected 8.0 or later and a driver for CUDA %s; build with "
                                    "CMAKE_CUDA_ARCHITECTURES=%d%d or take --backend cpu",
                                    properties.name, properties.major, properties.minor, versionText(driver).c_str(),
                                    versionText(runtime).c_str(), properties.major, properties.minor));
    if (code != cudaSuccess)
        return failure(ErrorCode::Device, formatString("the device does not start: %s (%s), expected success; take "
                                                       "--backend cpu",
                                                       cudaGetErrorString(code), cudaGetErrorName(code)));
    return {true, ErrorCode::Ok,
            formatString("%s, %.1f GiB, compute capability %d.%d, %d multiprocessors, driver for CUDA %s",
                         properties.name, double(properties.totalGlobalMem) / double(1 << 30), properties.major,
                         properties.minor, properties.multiProcessorCount, versionText(driver).c_str())};
}

DeviceFacts cudaFacts()
{
    cudaDeviceProp properties{};
    char bus[32] = {};
    GSC_CUDA_CHECK(cudaGetDeviceProperties(&properties, kDevice));
    GSC_CUDA_CHECK(cudaDeviceGetPCIBusId(bus, sizeof(bus), kDevice));
    const NvmlFacts nvml = nvmlFacts(bus);
    return {properties.name, nvml.driver,           properties.totalGlobalMem, uint32_t(properties.multiProcessorCount),
            nvml.clock_mhz,  nvml.memory_clock_mhz, cudaContextBytes()};
}

uint64_t cudaContextBytes()
{
    constexpr uint64_t kMost = 2ull << 30;  // more is another process's
    constexpr uint64_t kCode = 32ull << 20; // of kernels, which are loaded as they are launched
    static const uint64_t bytes = [] {
        const uint64_t before = usedBefore(), now = usedBytes();
        return before == 0 || now < before || now - before > kMost ? 0 : now - before + kCode;
    }();
    return bytes;
}

CudaLimits openCudaDevice()
{
    const CudaStatus status = cudaStatus();
    if (!status.usable)
        throw Error(status.code, "cuda: " + status.text);
    cudaDeviceProp properties{};
    GSC_CUDA_CHECK(cudaGetDeviceProperties(&properties, kDevice));
    return {uint32_t(properties.multiProcessorCount), properties.sharedMemPerBlockOptin};
}

} // namespace gsc
