# What `cmake --install` puts in place, and a Debian package of it (scripts/package).
include(GNUInstallDirs)
install(TARGETS polymorph RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS polymorph_oiio LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/polymorph)
if(TARGET polymorph_ocio)
  install(TARGETS polymorph_ocio LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/polymorph)
endif()
install(TARGETS polymorph_assimp RUNTIME DESTINATION ${CMAKE_INSTALL_LIBDIR}/polymorph)
# base/data_folder.h looks here.
install(DIRECTORY scenes/ DESTINATION ${CMAKE_INSTALL_DATADIR}/polymorph PATTERN golden EXCLUDE)
# What the jobs of CIs run (docs/ci.md).
install(DIRECTORY scripts/ci DESTINATION ${CMAKE_INSTALL_DATADIR}/polymorph USE_SOURCE_PERMISSIONS PATTERN __pycache__ EXCLUDE)
install(DIRECTORY scripts/openjd DESTINATION ${CMAKE_INSTALL_DATADIR}/polymorph)
install(FILES README.md CITATION.cff CHANGELOG.md CONTRIBUTING.md SECURITY.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)

# Manual pages and completions, made by the program from its own options.
set(pages ${CMAKE_BINARY_DIR}/pages)
add_custom_command(OUTPUT ${pages}/done VERBATIM DEPENDS polymorph
  COMMAND ${CMAKE_COMMAND} -E make_directory ${pages}
  COMMAND polymorph manual man -o ${pages}/man1 --overwrite
  COMMAND polymorph completion bash > ${pages}/polymorph
  COMMAND polymorph completion zsh > ${pages}/_polymorph
  COMMAND polymorph completion fish > ${pages}/polymorph.fish
  COMMAND ${CMAKE_COMMAND} -E touch ${pages}/done)
add_custom_target(pages ALL DEPENDS ${pages}/done)
install(DIRECTORY ${pages}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
install(FILES ${pages}/polymorph DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${pages}/_polymorph DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${pages}/polymorph.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)

# The bill of materials of what was linked; Debian's database and ninja's know it.
find_package(Python3 COMPONENTS Interpreter)
if(Python3_FOUND AND CMAKE_GENERATOR STREQUAL Ninja)
  set(sbom ${CMAKE_BINARY_DIR}/polymorph.spdx.json)
  add_custom_command(OUTPUT ${sbom} VERBATIM DEPENDS polymorph polymorph_oiio polymorph_assimp ${CMAKE_SOURCE_DIR}/scripts/sbom
    COMMAND Python3::Interpreter -B ${CMAKE_SOURCE_DIR}/scripts/sbom ${CMAKE_BINARY_DIR} polymorph
            $<TARGET_FILE:polymorph> $<TARGET_FILE:polymorph_oiio> $<TARGET_FILE:polymorph_assimp> > ${sbom})
  add_custom_target(sbom ALL DEPENDS ${sbom})
  install(FILES ${sbom} DESTINATION ${CMAKE_INSTALL_DOCDIR})
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME polymorph)
# Who makes the package maintains it: as Debian's tools are told, else the author of the last commit.
if(DEFINED ENV{DEBFULLNAME} AND DEFINED ENV{DEBEMAIL})
  set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
else()
  execute_process(COMMAND git log -1 "--format=%an <%ae>" WORKING_DIRECTORY ${CMAKE_SOURCE_DIR}
    OUTPUT_VARIABLE maintainer OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT maintainer)
  set(maintainer "unknown <unknown@localhost>")
endif()
set(CPACK_PACKAGE_CONTACT "${maintainer}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Renders morph sequences between polyhedra")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_POLYMORPH_BUILD ${CMAKE_BINARY_DIR})
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_SOURCE_DIR}/cmake/package_libraries.cmake)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS ffmpeg)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
  "A scene names a source, any objects on the way and a target. Each becomes spheres,
and the spheres metaballs; polymorph renders every frame of the morph between them
to EXR and PNG. Try: polymorph demo")
include(CPack)
