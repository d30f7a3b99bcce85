# SPDX-License-Identifier: Apache-2.0
# Sources of the CUDA renderer, relative to this folder. Plain C++: kernels are behind the launchers of gsc_kernels_cuda. Tests
# compile them for an emulated device too.
set(gsc_runtime_cuda
  cuda/chunk_reader.cpp
  cuda/cuda_device.cpp
  cuda/device_scene.cpp
  cuda/flight.cpp
  cuda/frame_graph.cpp
  cuda/frame_stages.cpp
  cuda/nvml.cpp
  cuda/picture_cuda.cpp
  cuda/renderer_cuda.cpp
  reuse/reuse_cuda.cpp)
