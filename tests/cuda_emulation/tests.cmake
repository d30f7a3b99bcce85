# SPDX-License-Identifier: Apache-2.0
# The CUDA backend without a GPU: kernels and runtime are compiled by the C++ compiler against the headers of
# cuda_emulation/include/, which stand for the toolkit's and for two of ours. Has the libraries and the test beside those of
# the toolkit.
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|aarch64|arm64)$")
  return()
endif()

add_library(gsc_cuda_emulation STATIC cuda_emulation/block.cpp cuda_emulation/fiber.cpp cuda_emulation/graph.cpp
                                      cuda_emulation/runtime.cpp)
target_link_libraries(gsc_cuda_emulation PRIVATE gsc_build_flags Threads::Threads)
# before all others, so what needs it links it first: a machine may have the toolkit, and ours lie in PROJECT_SOURCE_DIR
target_include_directories(gsc_cuda_emulation BEFORE PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/cuda_emulation/include)
target_include_directories(gsc_cuda_emulation PUBLIC ${PROJECT_SOURCE_DIR})
target_compile_definitions(gsc_cuda_emulation PUBLIC GSC_CUDA_EMULATION)

include(${PROJECT_SOURCE_DIR}/kernels/cuda_sources.cmake)
set(emulated_kernels ${gsc_cuda_exact} ${gsc_cuda_fast} ${gsc_cuda_plain})
list(TRANSFORM emulated_kernels PREPEND ${PROJECT_SOURCE_DIR}/kernels/)
list(TRANSFORM gsc_cuda_host PREPEND ${PROJECT_SOURCE_DIR}/kernels/)
# note: a property of this directory alone; where there is a toolkit, kernels/ still gives the same files to nvcc.
# The kernels read values as other types, as CUDA allows
set_source_files_properties(
  ${emulated_kernels} PROPERTIES LANGUAGE CXX COMPILE_OPTIONS "-fno-strict-aliasing;-Wno-unknown-pragmas")
add_library(gsc_kernels_cuda_emulated STATIC ${emulated_kernels} ${gsc_cuda_host})
target_link_libraries(gsc_kernels_cuda_emulated PUBLIC gsc_cuda_emulation gsc_format PRIVATE gsc_build_flags)

# the runtime with this backend in the place of the other, so that there is one list of backends in the program
include(${PROJECT_SOURCE_DIR}/runtime/cuda_sources.cmake)
set(emulated_runtime ${gsc_runtime_cuda} cuda/picture_scorer_cuda.cpp devices/device_list.cpp devices/device_pictures.cpp
    devices/device_scorer.cpp)
list(TRANSFORM emulated_runtime PREPEND ${PROJECT_SOURCE_DIR}/runtime/)
add_library(gsc_runtime_cuda_emulated STATIC ${emulated_runtime} cuda_emulation/ceilings.cpp
                                             $<TARGET_OBJECTS:gsc_runtime_host>)
target_link_libraries(gsc_runtime_cuda_emulated PUBLIC gsc_cuda_emulation gsc_camera gsc_format gsc_metrics
                      PRIVATE gsc_kernels gsc_kernels_cuda_emulated gsc_build_flags glm::glm ${CMAKE_DL_LIBS})
target_compile_definitions(gsc_runtime_cuda_emulated PRIVATE GSC_HAVE_CUDA)

add_executable(test_cuda_emulated ${gsc_test_cuda_sources} cuda_emulation/test_emulation.cpp)
gsc_compile_test_fast(test_cuda_emulated REUSE_FROM gsc_test_main)
target_link_libraries(test_cuda_emulated PRIVATE gsc_cuda_emulation gsc_test_synthetic gsc_runtime_cuda_emulated
                                                 gsc_kernels_cuda_emulated gsc_kernels gsc_build_flags doctest::doctest)
# in parts of about equal length, for machines with more than one core
set(whole_frames "*test_cuda_frame*,*test_cuda_far*,*test_cuda_graph*,*test_cuda_renderer*"
    "*backends/test_frames*,*backends/test_renderer*")
set(other_frames "*test_cuda_passes*,*test_cuda_shared*,*test_cuda_depth*,*test_cuda_service*,*test_cuda_bands*,*test_cuda_false*,*test_cuda_fovea*"
    "*backends/test_depths*,*backends/test_bands*,*backends/test_false*")
set(kept_frames "*test_cuda_reuse*,*test_cuda_coarse*,*backends/test_reuse*,*backends/test_coarse*")
list(JOIN whole_frames "," whole_frames)
list(JOIN other_frames "," other_frames)
add_test(NAME test_cuda_emulated_reuse COMMAND test_cuda_emulated "--source-file=${kept_frames}")
add_test(NAME test_cuda_emulated_frames COMMAND test_cuda_emulated "--source-file=${whole_frames}")
add_test(NAME test_cuda_emulated_passes COMMAND test_cuda_emulated "--source-file=${other_frames}")
if(GSC_SANITIZE)
  set(not_twice "--test-case-exclude=pictures have the bytes*") # two fifths of the time
endif()
add_test(NAME test_cuda_emulated_stages
         COMMAND test_cuda_emulated "--source-file-exclude=${whole_frames},${other_frames},${kept_frames}" ${not_twice})
set(emulated test_cuda_emulated_reuse test_cuda_emulated_frames test_cuda_emulated_passes)
set_tests_properties(${emulated} test_cuda_emulated_stages PROPERTIES LABELS "cpu;emulation" TIMEOUT 1200)
if(GSC_SANITIZE) # all whole frames would take an hour of a core: a few stand for them, beside every stage on its own
  set_tests_properties(${emulated} PROPERTIES LABELS "cpu;slow;emulation")
  set(some_frames "renderer: a picture*,renderer: two on*,renderer: a lost*,one decode for both eyes*between them"
      "lenses off*,image sizes that*,more anchors*,levels that lag*,eyes that are turned*,depths*"
      "reuse: a camera that stands*,reuse: depth decides*,reuse: a small cache*")
  list(JOIN some_frames "," some_frames)
  add_test(NAME test_cuda_emulated_some COMMAND test_cuda_emulated "--test-case=${some_frames}")
  set_tests_properties(test_cuda_emulated_some PROPERTIES LABELS "cpu;emulation" TIMEOUT 1200)
endif()
