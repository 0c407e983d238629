/// Every bound of the protocol, in one place; `cradled serve --print-limits` prints them.
#pragma once

#include <cstdint>

namespace cradle::limits {

// Names.
inline constexpr int kNameBytes = 31;       ///< of a body, a client or a world, without the zero
inline constexpr int kWorldNameBytes = 24;  ///< a channel name has 63 bytes in all

// Datagrams, bytes of the LCM payload and channel together.
inline constexpr int kNetworkDatagramBytes = 1400;    ///< fits an Ethernet frame
inline constexpr int kLoopbackDatagramBytes = 60000;  ///< fits LCM's short message
inline constexpr int kTrailerBytes = 32;              ///< reserved for authentication

// Numbers: ids, sequences, ticks, times.
inline constexpr std::int64_t kIntegerMax = (std::int64_t{1} << 53) - 1;

// Physical quantities; larger ones are refused: out_of_range.
inline constexpr double kPositionMax_m = 1e8;
inline constexpr double kSpeedMax_mps = 1e6;
inline constexpr double kAngularSpeedMax_radps = 1e5;
inline constexpr double kSizeMin_m = 1e-4;
inline constexpr double kSizeMax_m = 1e6;
inline constexpr double kMassMin_kg = 1e-9;
inline constexpr double kMassMax_kg = 1e15;
inline constexpr double kInertiaMin_kgm2 = 1e-18;
inline constexpr double kInertiaMax_kgm2 = 1e27;
inline constexpr double kFrictionMax = 100;
inline constexpr double kTurningFrictionMax_m = 1e6;  ///< rolling and torsional
inline constexpr double kWrenchMax = 1e18;            ///< magnitude of any wrench, in its unit
inline constexpr double kGravityMax_mps2 = 1e4;

// Commands.
inline constexpr int kReceiptsKept = 1024;              ///< a client, by sequence
inline constexpr int kHeldCommands = 256;               ///< a client, behind a gap
inline constexpr int kQueuedCommands = 4096;            ///< a client, for later ticks
inline constexpr std::int64_t kTicksAhead = 1'000'000;  ///< a target tick may lie ahead
inline constexpr int kClients = 64;                     ///< a world
inline constexpr int kInboxDatagrams = 16384;           ///< waiting for the next tick
inline constexpr std::int64_t kInboxBytes = 1 << 26;    ///< of them together
inline constexpr std::int64_t kWaitingBytes = 1 << 26;  ///< held and queued of all clients
inline constexpr std::int64_t kStepsPerCommand = 1'000'000;

// World; the configuration may set lower ones.
inline constexpr std::int64_t kBodies = 1'000'000;
inline constexpr std::int64_t kWrenches = 1'000'000;
inline constexpr std::int64_t kGeometries = 65'536;  ///< hulls, meshes, ... that it holds
inline constexpr std::int64_t kPoints = 4'000'000;   ///< of a hull, a mesh or a height field
inline constexpr std::int64_t kTriangles = 4'000'000;
inline constexpr std::int64_t kParts = 4096;  ///< of a compound
inline constexpr int kCorners = 64;           ///< of a polygon of a scene
inline constexpr double kRateMin_hz = 1;
inline constexpr double kRateMax_hz = 10'000;
inline constexpr int kSubStepsMax = 64;
inline constexpr double kContactToleranceMin_m = 1e-6;
inline constexpr double kContactToleranceMax_m = 1;

}  // namespace cradle::limits
