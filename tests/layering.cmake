# Includes may only point the ways of the table in README.md, "The map". Run as a script with ROOT.

function(check folder allowed forbidden)
  file(GLOB_RECURSE files ${ROOT}/${folder}/*.h ${ROOT}/${folder}/*.cpp)
  foreach(file IN LISTS files)
    file(STRINGS ${file} lines REGEX "^#include ")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^#include [<\"]([^>\"]+)[>\"].*" "\\1" include "${line}")
      set(is_ours FALSE)
      if(include MATCHES "/" AND NOT include MATCHES "^(sys|netinet|arpa)/")
        set(is_ours TRUE)
      endif()
      if((is_ours AND NOT include MATCHES "${allowed}") OR
         (forbidden AND include MATCHES "${forbidden}"))
        message(SEND_ERROR "${file} may not include ${include}")
      endif()
    endforeach()
  endforeach()
endfunction()

set(shells "^(chrono|ctime|time\\.h|thread|future|iostream|fstream|cstdio|filesystem|sys/|unistd)")
set(vocabulary "cradle/(types|result|limits|world_view|version)\\.h")
check(protocol/include "^${vocabulary}" "${shells}")
check(protocol "^(${vocabulary}|protocol/|cradle_wire/|lcm/|arpa/|netinet/)" "")
check(server/collision "^(${vocabulary}|server/collision/|Eigen/|fcl/)" "${shells}")
check(server/dynamics "^(${vocabulary}|server/(collision|dynamics)/|Eigen/)" "${shells}")
check(server/world
  "^(${vocabulary}|protocol/(command|validate)\\.h|server/(collision|dynamics|world)/|Eigen/)"
  "${shells}")
check(client/include "^(${vocabulary}|cradle/client[a-z_]*\\.h)" "")
check(client/src "^(cradle/|client/src/|protocol/)" "")
check(client/examples "^cradle/" "")
check(client/tools "^(cradle/|client/tools/|CLI/)" "")

# One file each for the libraries behind a seam, and no LCM outside protocol.
file(GLOB_RECURSE everything ${ROOT}/server/*.cpp ${ROOT}/server/*.h ${ROOT}/client/*.cpp
  ${ROOT}/client/*.h)
foreach(file IN LISTS everything)
  file(STRINGS ${file} lines REGEX "^#include [<\"](lcm|cradle_wire|fcl|server)/")
  foreach(line IN LISTS lines)
    if(line MATCHES "[<\"](lcm|cradle_wire)/")
      message(SEND_ERROR "${file}: only protocol may see LCM: ${line}")
    elseif(line MATCHES "[<\"]fcl/" AND NOT file MATCHES "fcl_[a-z_]+\\.cpp$")
      message(SEND_ERROR "${file}: FCL stays behind its own file: ${line}")
    elseif(line MATCHES "\"server/" AND file MATCHES "/client/")
      message(SEND_ERROR "${file}: the client may not see the server: ${line}")
    endif()
  endforeach()
endforeach()
