/// LCM over UDP multicast: sending through liblcm, receiving through our own LC02 receiver.
#pragma once

#include "protocol/transport/lcm_url.h"
#include "protocol/transport/transport.h"

namespace cradle {

enum class Lane { send_only, send_and_receive };

/// Opens one port. Fails with no_network and one line of advice where the host has no multicast
/// route.
OpenedTransport open_lcm_transport(const LcmUrl& url, Lane lane);

}  // namespace cradle
