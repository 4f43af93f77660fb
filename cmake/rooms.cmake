# A room is one folder of src/, with its subfolders, and one static library. Sources are globbed: adding a file is enough.
# Most presets compile eight files of a room as one unit, which takes a third of the time, sanitizers whole rooms: a name in
# an unnamed namespace therefore stands once in a room. The preset `dev` compiles each file alone.
# image/oiio, image/ocio and model/assimp are programs of their own (pm_program).
add_library(pm_flags INTERFACE)
target_compile_options(pm_flags INTERFACE
  # No contraction: the same bits on every compiler, and on the GPU (--fmad=false).
  $<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=${POLYMORPH_CONTRACT} -Werror=switch -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion>
  # GCC 12 fuses products and sums that alternate in sign (vfmaddsub) despite -ffp-contract=off; only
  # its vectorizer of straight-line code does so.
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fno-tree-slp-vectorize>
  # Messages name files of the checkout, wherever it lies, so that builds in two folders are the same bytes.
  "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-ffile-prefix-map=${CMAKE_SOURCE_DIR}/=;-ffile-prefix-map=${CMAKE_BINARY_DIR}/=build/>"
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${POLYMORPH_WERROR}>>:-Werror>
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<NOT:$<STREQUAL:${POLYMORPH_ARCH},>>>:-march=${POLYMORPH_ARCH}>
  # A type of an unnamed namespace within a State that is declared in a header: its file is included there.
  $<$<AND:$<COMPILE_LANG_AND_ID:CXX,GNU>,$<BOOL:${CMAKE_UNITY_BUILD}>>:-Wno-subobject-linkage>
  # Vectors of eight floats are passed in memory then, and stay within the program.
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<STREQUAL:${POLYMORPH_ARCH},>>:-Wno-psabi>)
if(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  # A char has a sign on x86-64 and none elsewhere.
  target_compile_options(pm_flags INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-fsigned-char>)
endif()
target_include_directories(pm_flags INTERFACE ${CMAKE_SOURCE_DIR} ${CMAKE_SOURCE_DIR}/src)

function(pm_room name)
  cmake_parse_arguments(ROOM "" "" "USES;LINK" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/${name}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/(oiio|ocio|assimp)/")
  if(NOT sources)
    add_library(pm_${name} INTERFACE)
    set(kind INTERFACE)
  else()
    add_library(pm_${name} STATIC ${sources})
    set(kind PUBLIC)
  endif()
  list(TRANSFORM ROOM_USES PREPEND pm_)
  target_link_libraries(pm_${name} ${kind} pm_flags ${ROOM_USES} ${ROOM_LINK})
endfunction()

# A text file of a room, compiled in as a std::string_view called NAME.
function(pm_embed room file name)
  set(from ${CMAKE_SOURCE_DIR}/src/${room}/${file})
  set(to ${CMAKE_BINARY_DIR}/embedded/${name}.cpp)
  set(script ${CMAKE_SOURCE_DIR}/cmake/embed.cmake)
  add_custom_command(OUTPUT ${to} DEPENDS ${from} ${script} VERBATIM
    COMMAND ${CMAKE_COMMAND} -DFROM=${from} -DTO=${to} -DNAME=${name} -P ${script})
  target_sources(pm_${room} PRIVATE ${to})
endfunction()

function(pm_kernels)
  set(sources ${CMAKE_SOURCE_DIR}/kernels/engine_cpu.cpp ${CMAKE_SOURCE_DIR}/kernels/interruption.cpp)
  if(PM_HAVE_CUDA)
    file(GLOB cuda_sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*.cu)
    list(APPEND sources ${cuda_sources} ${CMAKE_SOURCE_DIR}/kernels/parallel_copy.cpp)
  else()
    list(APPEND sources ${CMAKE_SOURCE_DIR}/kernels/engine_nocuda.cpp)
  endif()
  add_library(pm_kernels STATIC ${sources})
  # C++17: Debian 12's CMake cannot pass C++20 to nvcc, and both compilers read the same headers.
  set_target_properties(pm_kernels PROPERTIES CXX_STANDARD 17 CUDA_STANDARD 17 CUDA_STANDARD_REQUIRED ON
    UNITY_BUILD OFF)  # three files, which share few headers
  target_link_libraries(pm_kernels PUBLIC pm_flags TBB::tbb)
  if(PM_HAVE_CUDA)
    target_compile_options(pm_kernels PRIVATE $<$<COMPILE_LANGUAGE:CUDA>:--fmad=false -Xcompiler=-ffp-contract=off>)
    target_link_libraries(pm_kernels PRIVATE CUDA::cudart_static)
  endif()
  pm_add_avx512(pm_kernels)
endfunction()

# The renderer's CUDA code. Denormals are zero there, as they are in the CPU's tiles. Debian 12's CMake cannot pass
# C++20 to nvcc, so the command is written out; nvcc alone would leave fmt's functions without constexpr.
function(pm_cuda_tracer)
  if(NOT PM_HAVE_CUDA)
    return()
  endif()
  if(CMAKE_CUDA_COMPILER_VERSION VERSION_LESS 12.0)
    message(STATUS "nvcc ${CMAKE_CUDA_COMPILER_VERSION} knows no C++20: surfaces come from a GPU, and the CPU traces")
    return()
  endif()
  set(from ${CMAKE_SOURCE_DIR}/src/render/device/cuda_tracer.cu)
  set(to ${CMAKE_BINARY_DIR}/cuda_tracer.o)
  set(contraction false)
  if(POLYMORPH_CONTRACTION)
    set(contraction true)
  endif()
  set(architectures)
  foreach(architecture ${CMAKE_CUDA_ARCHITECTURES})
    string(REGEX REPLACE "-.*" "" number ${architecture})
    list(APPEND architectures -gencode=arch=compute_${number},code=sm_${number})
  endforeach()
  add_custom_command(OUTPUT ${to} DEPENDS ${from} DEPFILE ${to}.d VERBATIM
    COMMAND ${CMAKE_CUDA_COMPILER_LAUNCHER} ${CMAKE_CUDA_COMPILER} -std=c++20 -O3 --expt-relaxed-constexpr --fmad=${contraction} --ftz=true ${architectures}
      -Xcompiler=-ffp-contract=off,-fPIC -diag-suppress=20012 -DFMT_USE_CONSTEXPR=1 -DNDEBUG
      -I${CMAKE_SOURCE_DIR} -I${CMAKE_SOURCE_DIR}/src -MD -MF ${to}.d -c ${from} -o ${to})
  set_source_files_properties(${to} PROPERTIES EXTERNAL_OBJECT ON)
  target_sources(pm_render PRIVATE ${to})
  set_source_files_properties(src/render/device/cuda_tracer_none.cpp PROPERTIES COMPILE_DEFINITIONS PM_HAVE_CUDA)
  target_link_libraries(pm_render PUBLIC CUDA::cudart_static)
endfunction()

# base/program_identity.h, looked at in every build.
function(pm_identity)
  set(to ${CMAKE_BINARY_DIR}/generated/program_identity.cpp)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
  set(build "${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_BUILD_TYPE} ${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}} ${POLYMORPH_ARCH}")
  string(REGEX REPLACE "[\"\\; ]+" " " build "${build}")
  add_custom_target(program_identity BYPRODUCTS ${to} VERBATIM
    COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR} -DTO=${to} -DVERSION=${PROJECT_VERSION} -DBUILD=${build} -P ${CMAKE_SOURCE_DIR}/cmake/identity.cmake)
  target_sources(pm_base PRIVATE ${to})
  add_dependencies(pm_base program_identity)
endfunction()

function(pm_program)
  add_executable(polymorph ${CMAKE_SOURCE_DIR}/src/main.cpp)
  target_link_libraries(polymorph PRIVATE pm_cli)
  # OpenImageIO costs 0.3 s to load, so it sits in a module that is opened on first use.
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/image/oiio/*.cpp)
  add_library(polymorph_oiio MODULE ${sources})
  set_target_properties(polymorph_oiio PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
  target_link_libraries(polymorph_oiio PRIVATE pm_flags PkgConfig::OIIO)
  add_dependencies(polymorph polymorph_oiio)
  if(OCIO_FOUND)
    add_library(polymorph_ocio MODULE ${CMAKE_SOURCE_DIR}/src/image/ocio/ocio_module.cpp)
    set_target_properties(polymorph_ocio PROPERTIES PREFIX "" LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
    target_link_libraries(polymorph_ocio PRIVATE pm_flags PkgConfig::OCIO)
    add_dependencies(polymorph polymorph_ocio)
  endif()
  # Models, effects and scenes, found beside the program (base/data_folder.h).
  file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/share)
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/scenes ${CMAKE_BINARY_DIR}/share/polymorph SYMBOLIC)
  # Assimp reads what comes from anywhere; it does so in a process of its own.
  file(GLOB reader CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/model/assimp/*.cpp)
  add_executable(polymorph_assimp ${reader})
  target_link_libraries(polymorph_assimp PRIVATE pm_base PkgConfig::ASSIMP)
  add_dependencies(polymorph polymorph_assimp)
endfunction()
