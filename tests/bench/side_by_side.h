/// One case by Cradle and by its peers, on the same machine in turns: tens of milliseconds each.
/// What else a machine does changes from second to second, and takes up to half of a core's speed;
/// so it slows all of them alike.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/bench/peer.h"
#include "tests/bench/report.h"
#include "tests/bench/run.h"

namespace cradle::bench {

/// The time that engines are compared by, us a tick.
double time_us(const Case& which, const Row& row);

/// How an engine fared.
struct Fared {
  Row row;              ///< of the run with the median time, and the worst error of all runs; an
                        ///< error of NaN and no times if a run failed
  std::string outcome;  ///< "ok", or why a run failed
  /// Cradle's time over its own in the same round, the median of all rounds. None if one of them
  /// failed.
  std::optional<double> ratio = {};
  bool is_ok() const { return outcome == "ok"; }
};

struct SideBySide {
  const Case* which = nullptr;
  std::vector<Fared> engines;  ///< Cradle first, then the libraries
};

/// The cases that peers are given: all but those that repeat another at another size, or in a
/// plane.
bool is_for_peers(const Case& which);

/// One run of one peer, in this process. Of the options it takes `dt_s` alone. Throws PeerError.
Row run_peer(const PeerLibrary& library, const Case& which, Scene scene, const Options& options,
             const PeerSettings& settings = {}, const Between& between = {});

/// `run` and `run_peer` in a process of their own. Failures are outcomes.
Fared try_run(const Case& which, const Scene& scene, const Options& options);
Fared try_peer(const PeerLibrary& library, const Case& which, const Scene& scene,
               const Options& options, const PeerSettings& settings = {});

inline constexpr int kSideBySideRounds = 3;

/// Rounds, in each of which every engine runs once, all side by side in turns. `scene` is mostly
/// that of the case.
SideBySide compare(const Case& which, const Scene& scene, const Options& options,
                   std::span<const PeerLibrary> libraries, int rounds = kSideBySideRounds);

/// As a table: a line a case. As CSV: a line an engine, with the columns of `header`, and after
/// them the outcome and Cradle's time over the engine's.
std::string peers_header(Format format, std::span<const PeerLibrary> libraries);
std::string peers_lines(Format format, const SideBySide& result);

}  // namespace cradle::bench
