/// `cradled serve` as a process: configuration, network, signals, log, systemd.
#pragma once

#include "server/config_layers.h"

namespace cradle {

/// Opens the network, loads the scene, serves until SIGTERM, SIGINT or a shutdown command; 0 at the
/// end. SIGHUP reads the sources again.
/// Throws ConfigError, StartupError, SceneError, and std::filesystem::filesystem_error if a file
/// cannot be read.
int run_daemon(const ConfigSources& sources);

}  // namespace cradle
