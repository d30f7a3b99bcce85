# SPDX-License-Identifier: Apache-2.0
# Sources of the CUDA renderer, relative to this folder. Plain C++: kernels are behind the launchers of gsc_kernels_cuda. Tests
# compile them for an emulated device too.
set(gsc_runtime_cuda
  cuda/device/chunk_reader.cpp
  cuda/device/cuda_device.cpp
  cuda/device/device_scene.cpp
  cuda/device/nvml.cpp
  cuda/flight.cpp
  cuda/frame/frame_graph.cpp
  cuda/frame/frame_stages.cpp
  cuda/picture_cuda.cpp
  cuda/renderer_cuda.cpp
  reuse/coarse/coarse_cuda.cpp
  reuse/reuse_cuda.cpp)
