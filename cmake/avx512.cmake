# pm_add_avx512(TARGET): adds kernels/engine_avx512.cpp to a library, where compiler and linker can.
#
# A header's inline functions and templates, the standard library's among them, are compiled again there,
# for AVX-512, under the same names; of two the linker keeps one, for every processor. Hence the object
# is linked by itself first and all its names but the one that is called from outside are made local.
function(pm_add_avx512 target)
  set(local ${CMAKE_BINARY_DIR}/engine_avx512_local.o)
  include(CheckCXXCompilerFlag)
  check_cxx_compiler_flag(-march=x86-64-v4 PM_HAVE_X86_64_V4)
  execute_process(COMMAND ${CMAKE_LINKER} --help OUTPUT_VARIABLE help ERROR_QUIET)
  if(NOT PM_HAVE_X86_64_V4 OR NOT CMAKE_OBJCOPY OR NOT help MATCHES "force-group-allocation")
    message(STATUS "AVX-512 engine: OFF (needs -march=x86-64-v4, objcopy and GNU ld)")
    return()
  endif()
  add_library(pm_avx512 OBJECT ${CMAKE_SOURCE_DIR}/kernels/engine_avx512.cpp)
  set_target_properties(pm_avx512 PROPERTIES CXX_STANDARD 17)
  target_link_libraries(pm_avx512 PRIVATE pm_flags TBB::tbb)
  # A source's own options stand last, so that they win over POLYMORPH_ARCH. Without link-time optimisation the object holds machine code
  # whose names can be made local; symbols that are unique within a process (STB_GNU_UNIQUE) cannot. GCC 12 warns of undefined lanes in
  # its own header.
  set_source_files_properties(${CMAKE_SOURCE_DIR}/kernels/engine_avx512.cpp PROPERTIES
    COMPILE_OPTIONS "-march=x86-64-v4;-fno-lto;$<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique;-Wno-uninitialized>")
  add_custom_command(OUTPUT ${local} DEPENDS pm_avx512 $<TARGET_OBJECTS:pm_avx512> VERBATIM COMMAND_EXPAND_LISTS
    COMMAND ${CMAKE_LINKER} -r --force-group-allocation -o ${local} $<TARGET_OBJECTS:pm_avx512>
    COMMAND ${CMAKE_OBJCOPY} --keep-global-symbol=pm_make_avx512_engine ${local})
  set_source_files_properties(${local} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  target_sources(${target} PRIVATE ${local})
  target_compile_definitions(${target} PRIVATE PM_AVX512)
endfunction()
