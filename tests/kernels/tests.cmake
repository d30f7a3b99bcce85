# SPDX-License-Identifier: Apache-2.0
find_package(hwy REQUIRED)

# Models in memory, packed as the bake packs them. Other areas may link it.
add_library(gsc_test_synthetic STATIC kernels/synthetic_model.cpp kernels/synthetic_random.cpp
                                      ${PROJECT_SOURCE_DIR}/convert/bake/mlp_pack.cpp)
target_link_libraries(gsc_test_synthetic PUBLIC gsc_format PRIVATE gsc_build_flags)
target_include_directories(gsc_test_synthetic PUBLIC ${PROJECT_SOURCE_DIR})

set(kernel_libs gsc_test_synthetic gsc_runtime gsc_kernels hwy::hwy)
gsc_add_test(test_kernel_math SOURCES kernels/test_math.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_simd_math SOURCES kernels/test_simd_math.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_select SOURCES kernels/test_select.cpp kernels/test_classify.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_decode SOURCES kernels/test_decode.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_raster SOURCES kernels/test_project.cpp kernels/test_raster.cpp LIBS ${kernel_libs})
gsc_add_test(test_kernel_frame SOURCES kernels/test_frame.cpp LIBS ${kernel_libs})

if(GSC_BUILD_BENCH)
  find_package(benchmark REQUIRED)
  add_library(gsc_bench_scene STATIC bench/bench_scene.cpp)
  target_link_libraries(gsc_bench_scene PUBLIC gsc_kernels PRIVATE gsc_build_flags)
  add_executable(bench_kernels bench/bench_kernels.cpp)
  target_link_libraries(bench_kernels PRIVATE gsc_build_flags gsc_bench_scene ${kernel_libs} benchmark::benchmark)
  add_executable(bench_decode_model bench/bench_decode_model.cpp)
  target_link_libraries(bench_decode_model PRIVATE gsc_build_flags gsc_runtime gsc_kernels)
endif()
