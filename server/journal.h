/// Where applied commands go before they change anything. A seam: nothing is written yet.
#pragma once

#include <span>

#include "protocol/command.h"

namespace cradle {

class Journal {
 public:
  virtual ~Journal() = default;

  /// The commands that take effect before the step of `coming_tick`, in the order of their effect.
  virtual void append(Tick coming_tick, std::span<const Command> commands) = 0;
};

class NoJournal final : public Journal {
 public:
  void append(Tick, std::span<const Command>) override {}
};

}  // namespace cradle
