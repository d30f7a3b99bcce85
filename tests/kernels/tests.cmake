# SPDX-License-Identifier: Apache-2.0
find_package(hwy REQUIRED)
find_package(TBB REQUIRED)

# Models in memory, packed as the bake packs them. Other areas may link it.
add_library(gsc_test_synthetic STATIC kernels/synthetic_model.cpp kernels/synthetic_random.cpp
                                      ${PROJECT_SOURCE_DIR}/convert/write/mlp_pack.cpp)
target_link_libraries(gsc_test_synthetic PUBLIC gsc_format PRIVATE gsc_build_flags)
target_include_directories(gsc_test_synthetic PUBLIC ${PROJECT_SOURCE_DIR})

# says to the cases of backends/ that they are about the CPU
add_library(gsc_test_on_cpu STATIC backends/on_cpu.cpp)
target_link_libraries(gsc_test_on_cpu PUBLIC gsc_test_synthetic gsc_runtime gsc_kernels PRIVATE gsc_build_flags)

set(kernel_libs gsc_test_synthetic gsc_runtime gsc_scores gsc_metrics gsc_kernels gsc_simd)
gsc_add_test(test_kernel_math SOURCES kernels/test_math.cpp kernels/test_read_ahead.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_simd_math SOURCES kernels/test_simd_math.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_simd_support SOURCES kernels/test_simd_support.cpp LIBS ${kernel_libs} hwy::hwy)
foreach(threads tbb threads)
  gsc_add_test(test_parallel_${threads}
    SOURCES kernels/test_parallel.cpp ${PROJECT_SOURCE_DIR}/kernels/threads/parallel_${threads}.cpp
    LIBS gsc_format Threads::Threads $<$<STREQUAL:${threads},tbb>:TBB::tbb>
    TIMEOUT 120)
endforeach()
gsc_add_test(test_kernel_select SOURCES kernels/test_select.cpp kernels/test_classify.cpp backends/test_select.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_strip SOURCES kernels/test_policy.cpp kernels/test_strip.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_decode SOURCES kernels/test_decode.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_sensitivity SOURCES kernels/test_sensitivity.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_raster SOURCES kernels/test_project.cpp kernels/test_raster.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_coarse SOURCES kernels/test_coarse_rule.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_frame SOURCES kernels/test_frame.cpp backends/test_frames.cpp LIBS gsc_test_on_cpu ${kernel_libs})

set(gsc_test_cuda_sources
    support/gpu_main.cpp backends/on_cuda.cpp backends/test_frames.cpp backends/test_reuse.cpp backends/test_false_colours.cpp
    backends/test_bands.cpp backends/test_depths.cpp backends/test_renderer.cpp backends/test_select.cpp kernels/gpu_tools.cpp kernels/test_cuda_frame.cpp kernels/test_cuda_graph.cpp kernels/test_cuda_pictures.cpp kernels/test_cuda_passes.cpp kernels/test_cuda_renderer.cpp kernels/test_cuda_service.cpp kernels/test_cuda_depth.cpp kernels/test_cuda_bands.cpp kernels/test_cuda_false_colours.cpp kernels/test_cuda_foveation.cpp kernels/test_cuda_scores.cpp
    backends/test_coarse.cpp backends/test_coarse_models.cpp kernels/test_cuda_coarse_limits.cpp
    kernels/test_cuda_shared.cpp kernels/test_cuda_far.cpp kernels/test_cuda_reuse.cpp kernels/test_cuda_load.cpp kernels/test_cuda_select.cpp
    kernels/gpu_decode.cpp kernels/test_cuda_decode.cpp kernels/test_cuda_decode_ring.cpp
    kernels/test_cuda_touch.cpp kernels/gpu_bin.cpp kernels/test_cuda_bin.cpp kernels/test_cuda_sort.cpp kernels/blend_scene.cpp kernels/gpu_blend.cpp kernels/test_cuda_blend.cpp
    kernels/test_cuda_long_lists.cpp)
if(GSC_HAVE_CUDA)
  # to be carried to a machine that has a GPU and no toolkit: preset lean with GSC_BUILD_TESTS on makes it one file,
  # other builds need libtbb and libhwy beside it
  add_executable(test_cuda ${gsc_test_cuda_sources})
  gsc_compile_test_fast(test_cuda REUSE_FROM gsc_test_main)
  target_link_libraries(test_cuda PRIVATE gsc_build_flags ${kernel_libs} gsc_kernels_cuda doctest::doctest)
  target_include_directories(test_cuda SYSTEM PRIVATE ${CUDAToolkit_INCLUDE_DIRS}) # its runtime's functions alone
  target_link_options(test_cuda PRIVATE -static-libstdc++ -static-libgcc)
  set_target_properties(test_cuda PROPERTIES BUILD_RPATH "$ORIGIN")
  add_test(NAME test_cuda COMMAND test_cuda)
  add_test(NAME test_cuda_lost COMMAND test_cuda "--test-case=*lost device*" --no-skip)
  set_tests_properties(test_cuda test_cuda_lost PROPERTIES LABELS gpu TIMEOUT 600 SKIP_RETURN_CODE 77)
endif()

if(GSC_BUILD_BENCH)
  find_package(benchmark REQUIRED)
  add_library(gsc_bench_scene STATIC bench/bench_scene.cpp)
  target_link_libraries(gsc_bench_scene PUBLIC gsc_kernels gsc_runtime PRIVATE gsc_build_flags)
  add_executable(bench_kernels bench/bench_kernels.cpp)
  target_link_libraries(bench_kernels PRIVATE gsc_build_flags gsc_bench_scene ${kernel_libs} benchmark::benchmark)
  add_executable(bench_decode_model bench/bench_decode_model.cpp)
  target_link_libraries(bench_decode_model PRIVATE gsc_build_flags gsc_runtime gsc_kernels)
  add_executable(bench_reuse bench/bench_reuse.cpp)
  target_link_libraries(bench_reuse PRIVATE gsc_build_flags gsc_cameras gsc_runtime gsc_kernels)
  if(TARGET gsc_player)
    add_executable(bench_bands bench/bench_bands.cpp)
    target_link_libraries(bench_bands PRIVATE gsc_build_flags gsc_player)
    add_executable(bench_occlusion bench/bench_occlusion.cpp)
    target_link_libraries(bench_occlusion PRIVATE gsc_build_flags gsc_player gsc_kernels)
    if(TARGET gsc_present)
      add_executable(bench_present bench/bench_present.cpp)
      target_link_libraries(bench_present PRIVATE gsc_build_flags gsc_player gsc_module)
    endif()
    add_executable(bench_renderers bench/bench_renderers.cpp)
    target_link_libraries(bench_renderers PRIVATE gsc_build_flags gsc_player)
    if(GSC_HAVE_CUDA)
      target_compile_definitions(bench_renderers PRIVATE GSC_HAVE_CUDA)
      target_link_libraries(bench_renderers PRIVATE CUDA::cudart_static)
    endif()
  endif()
  add_executable(bench_png bench/bench_png.cpp)
  target_link_libraries(bench_png PRIVATE gsc_build_flags gsc_image)
  add_executable(bench_archive bench/bench_archive.cpp)
  target_link_libraries(bench_archive PRIVATE gsc_build_flags gsc_format)
  add_executable(bench_sensitivity bench/bench_sensitivity.cpp)
  target_link_libraries(bench_sensitivity PRIVATE gsc_build_flags gsc_runtime gsc_kernels)
endif()
