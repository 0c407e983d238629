/// How `cradled` ends: the codes of sysexits.h.
#pragma once

namespace cradle {

enum ExitCode : int {
  kExitOk = 0,
  kExitUsage = 64,      ///< the command line is wrong
  kExitData = 65,       ///< the scene is wrong
  kExitNoInput = 66,    ///< a scene or configuration file cannot be read
  kExitNoNetwork = 69,  ///< no multicast, or a port cannot be opened
  kExitInternal = 70,   ///< a fault of the program
  kExitOutput = 73,     ///< an output file cannot be written
  kExitTaken = 75,      ///< another daemon serves this world
  kExitConfig = 78,     ///< the configuration is wrong
};

}  // namespace cradle
