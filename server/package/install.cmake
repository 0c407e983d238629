# What `cmake --install` puts where. Components: daemon (programs and their manuals), runtime (the
# shared client library), development (headers, static library, CMake package, .pc, examples).
# Nothing but the service units knows the prefix: it may be moved.

# Debian's own folder of libraries, in which its linker, CMake and pkg-config look below any prefix.
if(EXISTS /etc/debian_version AND CMAKE_LIBRARY_ARCHITECTURE)
  set(CMAKE_INSTALL_LIBDIR lib/${CMAKE_LIBRARY_ARCHITECTURE} CACHE PATH "Libraries, below the prefix")
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(share ${CMAKE_INSTALL_DATADIR})

# --- daemon ---------------------------------------------------------------------------------------
install(TARGETS cradled DESTINATION ${CMAKE_INSTALL_SBINDIR} COMPONENT daemon)
install(TARGETS cradle DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT daemon)
install(FILES server/man/cradled.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8 COMPONENT daemon)
install(FILES server/man/cradled-scene.5 DESTINATION ${CMAKE_INSTALL_MANDIR}/man5 COMPONENT daemon)
install(FILES client/man/cradle.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT daemon)
set(completions ${share}/bash-completion/completions)
install(FILES server/package/completion.bash DESTINATION ${completions} COMPONENT daemon
  RENAME cradled)
install(FILES server/package/completion.bash DESTINATION ${completions} COMPONENT daemon
  RENAME cradle)
install(FILES tests/scenes/demo.toml DESTINATION ${share}/cradle COMPONENT daemon)
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${share}/doc/cradle COMPONENT daemon)

# The units name the daemon by its full path; the configuration of a system is in /etc.
file(GLOB units CONFIGURE_DEPENDS server/deploy/*.service)
file(GLOB config CONFIGURE_DEPENDS server/deploy/cradled.toml)
install(CODE "
  set(units \"${units}\")
  set(config \"${config}\")
  set(sbin \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_SBINDIR}\")
  include(\"${CMAKE_CURRENT_LIST_DIR}/install_units.cmake\")" COMPONENT daemon)

# --- client library -------------------------------------------------------------------------------
set(cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/cradle)
set(package_dir ${CMAKE_SOURCE_DIR}/client/package)
set(kinds static)
if(CRADLE_SHARED)
  list(APPEND kinds shared)
endif()
foreach(kind IN LISTS kinds)
  set(target cradle_client)
  if(kind STREQUAL "shared")
    set(target cradle_client_shared)
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME client_${kind})
  install(TARGETS ${target} EXPORT ${kind}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT ${kind} NAMESPACE cradle:: FILE cradle-${kind}.cmake
    DESTINATION ${cmake_dir} COMPONENT development)
endforeach()
configure_file(${package_dir}/cradle-config.cmake.in package/cradle-config.cmake @ONLY)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/package/cradle-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${package_dir}/lcm.cmake ${CMAKE_BINARY_DIR}/package/cradle-config.cmake
  ${CMAKE_BINARY_DIR}/package/cradle-config-version.cmake
  DESTINATION ${cmake_dir} COMPONENT development)

cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX OUTPUT_VARIABLE up_to_prefix
  BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/pkgconfig)
set(always_libs)
if(NOT CRADLE_SHARED)
  set(always_libs " -llcm -pthread")  # the static library is the only one
endif()
configure_file(${package_dir}/cradle-client.pc.in package/cradle-client.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/package/cradle-client.pc
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

install(DIRECTORY client/include/cradle protocol/include/cradle
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN *.h)
install(DIRECTORY lcmtypes DESTINATION ${share}/cradle COMPONENT development)
install(DIRECTORY client/examples DESTINATION ${share}/doc/cradle COMPONENT development)
