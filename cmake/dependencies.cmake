# Everything here is a Debian 12 package; scripts/setup names and installs them.
find_package(PkgConfig REQUIRED)
find_package(fmt 9 CONFIG REQUIRED)
find_package(spdlog CONFIG REQUIRED)
find_package(TBB 2021 CONFIG REQUIRED)
find_package(nlohmann_json 3.11 CONFIG REQUIRED)
find_package(CLI11 2.1 CONFIG REQUIRED)
find_package(embree 3.13 CONFIG REQUIRED)
# Debian's tinyobjloader calls itself "2rc10", which no version range matches.
find_package(tinyobjloader CONFIG REQUIRED)
find_package(Eigen3 3.4 CONFIG REQUIRED)
find_path(NANOFLANN_INCLUDE nanoflann.hpp REQUIRED)  # Debian's package has no CMake config
find_package(PNG REQUIRED)
# Headers only; its CMake config would bring the library and the solvers it was built with.
find_path(LEMON_INCLUDE lemon/network_simplex.h REQUIRED)
find_path(MESHOPTIMIZER_INCLUDE meshoptimizer.h REQUIRED)  # its CMake config lies where none is looked for
find_library(MESHOPTIMIZER_LIBRARY meshoptimizer REQUIRED)
pkg_check_modules(XXHASH REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(DEFLATE REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(ARCHIVE REQUIRED IMPORTED_TARGET libarchive)
pkg_check_modules(NETTLE REQUIRED IMPORTED_TARGET nettle)
pkg_check_modules(QHULL REQUIRED IMPORTED_TARGET qhull_r)
find_path(GIF_INCLUDE gif_lib.h REQUIRED)
find_library(GIF_LIBRARY gif REQUIRED)
if(NOT TARGET PkgConfig::GIF)
  add_library(PkgConfig::GIF INTERFACE IMPORTED)
  set_target_properties(PkgConfig::GIF PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES ${GIF_INCLUDE} INTERFACE_LINK_LIBRARIES ${GIF_LIBRARY})
endif()

# OpenEXR's config looks for PyImath and says so; nothing here needs it.
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
find_package(Imath 3.1 CONFIG REQUIRED)
find_package(OpenEXR 3.1 CONFIG REQUIRED)
unset(CMAKE_MESSAGE_LOG_LEVEL)

# By pkg-config: Debian's CMake config of OpenImageIO insists on the programs of another package and names
# /usr/include/opencv4, which no package of it contains.
pkg_check_modules(OIIO REQUIRED IMPORTED_TARGET OpenImageIO>=2.4)
# Views of displays alone need it, so that everything builds without.
pkg_check_modules(OCIO IMPORTED_TARGET OpenColorIO>=2.1)
pkg_check_modules(ASSIMP REQUIRED IMPORTED_TARGET assimp>=5.2)
