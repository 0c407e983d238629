# Runs at installation, with `units` and `config` (files) and `sbin` (the folder of cradled):
# service units that name the programs and files of this prefix, and the daemon's configuration.
set(etc ${CMAKE_INSTALL_PREFIX}/etc)
if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  set(etc /etc)
endif()

foreach(unit IN LISTS units)
  cmake_path(GET unit FILENAME name)
  file(READ ${unit} text)
  string(REGEX REPLACE "/[a-z/]*bin/cradled" "${sbin}/cradled" text "${text}")
  string(REPLACE "/etc/cradle/" "${etc}/cradle/" text "${text}")
  if(NOT etc STREQUAL "/etc")  # the daemon looks into /etc unless it is told otherwise
    string(REGEX REPLACE "(ExecStart=[^\n]* serve)\n"
      "\\1 --config ${etc}/cradle/cradled.toml\n" text "${text}")
  endif()
  set(installed ${CMAKE_INSTALL_PREFIX}/lib/systemd/system/${name})
  message(STATUS "Installing: $ENV{DESTDIR}${installed}")
  file(WRITE "$ENV{DESTDIR}${installed}" "${text}")
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES ${installed})
endforeach()

if(EXISTS "$ENV{DESTDIR}${etc}/cradle/cradled.toml")
  message(STATUS "Kept: $ENV{DESTDIR}${etc}/cradle/cradled.toml")
elseif(config)
  file(INSTALL ${config} DESTINATION ${etc}/cradle)
endif()
