# SPDX-License-Identifier: Apache-2.0
find_package(nlohmann_json 3.11 REQUIRED)

gsc_add_test(test_camera SOURCES runtime/test_camera.cpp LIBS gsc_camera nlohmann_json::nlohmann_json)
gsc_add_test(test_metrics SOURCES runtime/test_metrics.cpp runtime/naive_flip.cpp LIBS gsc_metrics)
gsc_add_test(test_lpips SOURCES runtime/test_lpips.cpp LIBS gsc_lpips)
gsc_add_test(test_frame_plan SOURCES runtime/test_frame_plan.cpp LIBS gsc_runtime)
gsc_add_test(test_frame_stats SOURCES runtime/test_frame_stats.cpp LIBS gsc_runtime nlohmann_json::nlohmann_json)
gsc_add_test(test_scene SOURCES runtime/test_scene.cpp LIBS gsc_runtime gsc_test_tiny)
gsc_add_test(test_lod SOURCES runtime/test_lod_lag.cpp runtime/test_frame_guard.cpp runtime/test_guard_order.cpp
                              runtime/test_guard_detail.cpp
                      LIBS gsc_test_synthetic gsc_runtime gsc_kernels)
gsc_add_test(test_local_model SOURCES runtime/test_local_model.cpp LIBS gsc_test_synthetic gsc_runtime gsc_kernels)
gsc_add_test(test_reuse SOURCES runtime/test_reuse.cpp runtime/test_reuse_error.cpp backends/test_reuse.cpp
                        LIBS gsc_test_on_cpu)
gsc_add_test(test_coarse SOURCES runtime/test_coarse.cpp backends/test_coarse.cpp backends/test_coarse_models.cpp LIBS gsc_test_on_cpu)
gsc_add_test(test_camera_motion SOURCES runtime/test_camera_motion.cpp LIBS gsc_runtime gsc_kernels)
gsc_add_test(test_stereo SOURCES runtime/test_stereo.cpp LIBS gsc_test_synthetic gsc_runtime gsc_kernels)
gsc_add_test(test_bands SOURCES runtime/test_bands.cpp backends/test_bands.cpp LIBS gsc_test_on_cpu)
gsc_add_test(test_renderer SOURCES runtime/test_renderer.cpp backends/test_renderer.cpp backends/test_depths.cpp LIBS gsc_test_on_cpu)
gsc_add_test(test_false_colours SOURCES runtime/test_false_colours.cpp backends/test_false_colours.cpp
                                LIBS gsc_test_on_cpu)
