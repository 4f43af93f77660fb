# Read by cpack: the packages that the programs' libraries come from. OpenImageIO and the hundreds of packages that it brings are
# recommended: its module is opened when a picture other than PNG or EXR is read.
set(folder ${CPACK_POLYMORPH_BUILD}/package-libraries)
file(WRITE ${folder}/debian/control "Source: polymorph\n\nPackage: polymorph\nArchitecture: any\n")
# The module of views is there where OpenColorIO was when the program was built; OpenImageIO needs that, too.
set(views ${CPACK_POLYMORPH_BUILD}/polymorph_ocio.so)
if(NOT EXISTS ${views})
  set(views)
endif()
execute_process(WORKING_DIRECTORY ${folder} OUTPUT_VARIABLE libraries COMMAND_ERROR_IS_FATAL ANY
  COMMAND dpkg-shlibdeps --ignore-missing-info --warnings=0 -O
    -dDepends ${CPACK_POLYMORPH_BUILD}/polymorph ${CPACK_POLYMORPH_BUILD}/polymorph_assimp
    -dRecommends ${CPACK_POLYMORPH_BUILD}/polymorph_oiio.so ${views})
foreach(field Depends Recommends)
  if(NOT libraries MATCHES "shlibs:${field}=([^\n]+)")
    message(FATAL_ERROR "dpkg-shlibdeps names no ${field}: ${libraries}")
  endif()
  string(TOUPPER ${field} upper)
  set(CPACK_DEBIAN_PACKAGE_${upper} "${CMAKE_MATCH_1}")
endforeach()
