# SPDX-License-Identifier: Apache-2.0
# Sources of the CUDA backend, relative to this folder: nvcc's, and those that tests compile for an emulated device. By what
# nvcc may do to their arithmetic.

# it fuses what the trainers' kernels fuse and nothing else (math/README.md): -fmad=false
set(gsc_cuda_exact
  select/select.cu
  decode/exact/decode_tiled.cu
  decode/exact/decode_any.cu
  reuse/select_strips.cu
  blend/cuda/blend_exact.cu
  present/present.cu
  metrics/squares.cu
  metrics/ssim.cu
  metrics/flip.cu)
# the tier `fast`: subnormal numbers are zero, roots and quotients good to 2 units in the last place
set(gsc_cuda_fast
  decode/fast/decode_fast.cu
  decode/fast/decode_compact.cu
  reuse/decode_keep.cu
  reuse/draw_kept.cu
  coarse/coarse_make.cu
  coarse/coarse_draw.cu
  coarse/coarse_paint.cu
  blend/cuda/blend_fast.cu)
# it has little arithmetic
set(gsc_cuda_plain
  upload/upload.cu
  select/pass_list.cu
  bin/bin.cu
  sort/sort.cu
  reuse/schedule.cu
  coarse/coarse_schedule.cu
  reuse/paint_kept.cu
  present/paint.cu
  cuda/stage_clock.cu)
# the host's side
set(gsc_cuda_host
  cuda/cuda_check.cpp
  decode/fast/pack_fragments.cpp
  decode/exact/pack_tiles.cpp)
