/// `cradle watch`: bodies as they move.
#pragma once

#include "session.h"

namespace cradle::tool {

/// On a terminal a table that is drawn anew about ten times a second, else one a second. Ends after
/// `duration`, at the end of a recording, or with SIGINT or SIGTERM.
int watch(Session& session, std::chrono::duration<double> duration);

}  // namespace cradle::tool
