# The module that `import polymorph` loads, and what a wheel holds beside it: the program, its model reader, and their data.
# scripts/wheel adds their libraries. Its image reader stays outside: Debian's OpenImageIO brings some 240 libraries along,
# GPL ones among them.
find_package(Python 3.9 REQUIRED COMPONENTS Interpreter Development.Module)
execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir OUTPUT_STRIP_TRAILING_WHITESPACE
  OUTPUT_VARIABLE nanobind_ROOT COMMAND_ERROR_IS_FATAL ANY)
find_package(nanobind CONFIG REQUIRED)
nanobind_add_module(polymorph_python NB_STATIC
  ${CMAKE_SOURCE_DIR}/python/module.cpp ${CMAKE_SOURCE_DIR}/python/call.cpp ${CMAKE_SOURCE_DIR}/python/arrays.cpp)
set_target_properties(polymorph_python PROPERTIES OUTPUT_NAME _polymorph EXCLUDE_FROM_ALL ON)
target_link_libraries(polymorph_python PRIVATE pm_inspect)

install(TARGETS polymorph polymorph_assimp RUNTIME DESTINATION bin COMPONENT python EXCLUDE_FROM_ALL)
install(TARGETS polymorph_python LIBRARY DESTINATION . COMPONENT python EXCLUDE_FROM_ALL)
install(DIRECTORY scenes/ DESTINATION share/polymorph COMPONENT python EXCLUDE_FROM_ALL PATTERN golden EXCLUDE)
# Its bill of materials, where wheels keep them (PEP 770).
set(python_sbom ${CMAKE_BINARY_DIR}/polymorph-render.spdx.json)
add_custom_command(OUTPUT ${python_sbom} VERBATIM DEPENDS polymorph polymorph_assimp polymorph_python ${CMAKE_SOURCE_DIR}/scripts/sbom
  COMMAND ${Python_EXECUTABLE} -B ${CMAKE_SOURCE_DIR}/scripts/sbom ${CMAKE_BINARY_DIR} polymorph-render
          $<TARGET_FILE:polymorph> $<TARGET_FILE:polymorph_assimp> $<TARGET_FILE:polymorph_python> > ${python_sbom})
add_custom_target(python_sbom DEPENDS ${python_sbom})
install(FILES ${python_sbom} DESTINATION ${SKBUILD_METADATA_DIR}/sboms COMPONENT python EXCLUDE_FROM_ALL)
# The licences of the libraries, as Debian's packages of them state them.
install(CODE [[
  file(GET_RUNTIME_DEPENDENCIES EXECUTABLES "$<TARGET_FILE:polymorph>" "$<TARGET_FILE:polymorph_assimp>" RESOLVED_DEPENDENCIES_VAR libraries)
  # /lib is /usr/lib, but packages say either. One question for all: Debian's database is read for each.
  list(TRANSFORM libraries REPLACE "^/usr/" "/" OUTPUT_VARIABLE names)
  list(TRANSFORM names PREPEND "/usr" OUTPUT_VARIABLE long_names)
  execute_process(COMMAND dpkg-query -S ${names} ${long_names} OUTPUT_VARIABLE owners ERROR_QUIET)
  string(REGEX MATCHALL "[^:\n]+:[^\n]*" owners "${owners}")
  list(TRANSFORM owners REPLACE ":.*" "")
  list(REMOVE_DUPLICATES owners)
  foreach(owner ${owners})
    if(EXISTS /usr/share/doc/${owner}/copyright)
      file(INSTALL DESTINATION "${CMAKE_INSTALL_PREFIX}/licenses" RENAME ${owner}.txt TYPE FILE
        FOLLOW_SYMLINK_CHAIN FILES /usr/share/doc/${owner}/copyright)
    endif()
  endforeach()]] COMPONENT python EXCLUDE_FROM_ALL)
