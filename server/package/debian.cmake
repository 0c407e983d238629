# `cpack` in the build folder makes three Debian packages of what is built there: cradled,
# libcradle-client0 and libcradle-client-dev.
set(CRADLE_MAINTAINER "Seed 72c53bde maintainers <maintainers@users.noreply.h-seed-72c53bde.example>"
  CACHE STRING "Who maintains the packages")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME cradle)
set(CPACK_PACKAGE_CONTACT "${CRADLE_MAINTAINER}")
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON)  # so that the configuration lands in /etc
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/debian_staging.cmake)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_COMPONENTS_ALL daemon development)
if(CRADLE_SHARED)
  list(APPEND CPACK_COMPONENTS_ALL runtime)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
set(control_dir ${CMAKE_BINARY_DIR}/package)

set(CPACK_DEBIAN_DAEMON_PACKAGE_NAME cradled)
set(CPACK_DEBIAN_DAEMON_PACKAGE_SECTION net)
set(CPACK_DEBIAN_DAEMON_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_DAEMON_DESCRIPTION "rigid body physics server over LCM
cradled owns a world of rigid bodies and steps it at a fixed rate. Programs
spawn bodies, push them and watch them move, over LCM multicast on loopback
or a local network. cradle does the same from the command line.")
if(config)
  file(WRITE ${control_dir}/conffiles "/etc/cradle/cradled.toml\n")
  set(CPACK_DEBIAN_DAEMON_PACKAGE_CONTROL_EXTRA ${control_dir}/conffiles)
endif()

set(runtime libcradle-client${CRADLE_CLIENT_ABI})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME ${runtime})
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "client library of the physics server Cradle
With it a game or a tool finds a world of cradled, changes it, and follows
what moves. This is the shared library.")
# CPack would write scripts that call ldconfig, unless it is given some: those that are not there it
# leaves out, with a warning. Debian's way is the trigger.
file(WRITE ${control_dir}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA
  ${control_dir}/triggers ${control_dir}/none/postinst ${control_dir}/none/postrm)

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcradle-client-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "liblcm-dev, libc6-dev")
if(CRADLE_SHARED)
  string(PREPEND CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${runtime} (= ${PROJECT_VERSION}), ")
endif()
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
  "client library of the physics server Cradle, for development
Headers, the static library, a CMake package that gives cradle::client, a
file for pkg-config, examples, and the definitions of the messages for other
languages.")
include(CPack)
