# SPDX-License-Identifier: Apache-2.0
# Small valid files in memory; other areas' tests link it too.
add_library(gsc_test_tiny STATIC format/tiny_gsc.cpp format/tiny_mlps.cpp format/tiny_seal.cpp)
target_link_libraries(gsc_test_tiny PUBLIC gsc_format PRIVATE gsc_build_flags)

gsc_add_test(test_stand_in SOURCES format/test_stand_in.cpp LIBS gsc_format)
gsc_add_test(test_format_open SOURCES format/test_open.cpp format/mutation.cpp LIBS gsc_test_tiny)
gsc_add_test(
  test_format_mutations
  SOURCES
  format/test_mutations.cpp
  format/mutation.cpp
  format/mutations_chunks.cpp
  format/mutations_model.cpp
  format/mutations_payload.cpp
  format/mutations_sensitivity.cpp
  format/mutations_table.cpp
  format/mutations_weights.cpp
  LIBS
  gsc_test_tiny)
if(GSC_HAVE_ZSTD)
  gsc_add_test(test_archive SOURCES format/test_archive.cpp format/test_steps.cpp format/tiny_archive.cpp LIBS gsc_test_tiny)
endif()
gsc_add_test(test_format_writer SOURCES format/test_writer.cpp format/mutation.cpp LIBS gsc_test_tiny Threads::Threads)
gsc_add_test(test_format_output_file SOURCES format/test_output_file.cpp LIBS gsc_format Threads::Threads)
gsc_add_test(test_format_file_fault SOURCES format/test_file_fault.cpp LIBS gsc_format Threads::Threads)
gsc_add_test(test_machine SOURCES format/test_machine.cpp LIBS gsc_format Threads::Threads)
gsc_add_test(test_format_basics SOURCES format/test_basics.cpp LIBS gsc_test_tiny)
