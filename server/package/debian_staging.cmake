# Runs in cpack, when everything is installed into one folder a component: what Debian wants of a
# package beyond what `cmake --install` makes.
if(NOT CPACK_GENERATOR STREQUAL "DEB")
  return()
endif()
find_program(GZIP gzip REQUIRED)
find_program(STRIP strip REQUIRED)
string(TIMESTAMP now "%a, %d %b %Y %H:%M:%S +0000" UTC)
set(source ${CMAKE_CURRENT_LIST_DIR}/../..)

foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  set(root ${CPACK_TEMPORARY_DIRECTORY}/${component})
  string(TOUPPER ${component} upper)
  set(docs ${root}/usr/share/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  file(READ ${source}/LICENSE licence)
  file(WRITE ${docs}/copyright
    "${CPACK_PACKAGE_NAME} ${CPACK_PACKAGE_VERSION}, ${CPACK_PACKAGE_CONTACT}\n\n${licence}")
  file(WRITE ${docs}/changelog "${CPACK_PACKAGE_NAME} (${CPACK_PACKAGE_VERSION}) unstable; urgency=medium

  * What changed: CHANGELOG.md in /usr/share/doc/cradle of the package cradled.

 -- ${CPACK_PACKAGE_CONTACT}  ${now}
")
  file(GLOB pages ${root}/usr/share/man/man*/*.[1-8])
  execute_process(COMMAND ${GZIP} -9n ${docs}/changelog ${pages} COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB_RECURSE archives ${root}/*.a)
  if(archives)
    execute_process(COMMAND ${STRIP} --strip-debug --enable-deterministic-archives ${archives}
      COMMAND_ERROR_IS_FATAL ANY)
  endif()
endforeach()
