# LCM as the target cradle::lcm. Debian's has no CMake package, and its pkg-config file asks for
# glib's, on which it does not depend. Used by Cradle's build, and by those who link the installed
# static library: these need no headers, and the name of the runtime library will do for them.
if(NOT TARGET cradle::lcm)
  find_library(LCM_LIBRARY NAMES lcm liblcm.so.1)
  find_path(LCM_INCLUDE_DIR lcm/lcm.h)
  mark_as_advanced(LCM_LIBRARY LCM_INCLUDE_DIR)
  if(LCM_LIBRARY)
    add_library(cradle::lcm UNKNOWN IMPORTED)
    set_target_properties(cradle::lcm PROPERTIES IMPORTED_LOCATION "${LCM_LIBRARY}")
  endif()
endif()
