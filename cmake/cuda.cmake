# CUDA where nvcc exists: kernels/*.cu; without it engine_nocuda.cpp gives the same symbols.
set(PM_HAVE_CUDA OFF)
if(NOT POLYMORPH_CUDA STREQUAL "OFF")
  include(CheckLanguage)
  # Before the language is enabled: "native" fails without a GPU, and CUDA 13 dropped all below sm_75. Code for 8.0 runs
  # on 8.6 and 8.9, too, and each architecture takes as long as the others to compile for.
  if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES)
    set(CMAKE_CUDA_ARCHITECTURES 75-real 80-real 90-real 100-real 120)
  endif()
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    enable_language(CUDA)
    find_package(CUDAToolkit REQUIRED)
    set(PM_HAVE_CUDA ON)
  elseif(POLYMORPH_CUDA STREQUAL "ON")
    message(FATAL_ERROR "POLYMORPH_CUDA=ON but no nvcc was found - install the CUDA Toolkit or use AUTO")
  endif()
endif()
message(STATUS "CUDA backend: ${PM_HAVE_CUDA}")
