/// Who looks after a running daemon: its process, with signals and systemd behind it.
///
/// Called from the daemon's loop, in its thread: that these calls come is the proof that it lives.
#pragma once

#include <cradle/world_view.h>

namespace cradle {

class Supervisor {
 public:
  virtual ~Supervisor() = default;

  /// Readable when something is wanted: attend() is called then, between two ticks.
  virtual int descriptor() const = 0;

  /// False: the daemon shall end.
  virtual bool attend() = 0;

  /// A status has gone out. The first one says that the world serves.
  virtual void heartbeat(const WorldStatus& status) = 0;
};

/// Ends the daemon when a descriptor is readable, and nothing else.
class StopDescriptor final : public Supervisor {
 public:
  explicit StopDescriptor(int descriptor) : descriptor_(descriptor) {}

  int descriptor() const override { return descriptor_; }
  bool attend() override { return false; }
  void heartbeat(const WorldStatus&) override {}

 private:
  int descriptor_;
};

}  // namespace cradle
