/// An Executor with threads of its own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "server/collision/executor.h"

namespace cradle {

/// Threads that wait for work awake during a shift and for a while after a call, because a tick
/// makes hundreds of calls of some microseconds; then they sleep. for_ranges() takes part itself,
/// and returns when all is done; it may be called from one thread at a time, and not from within a
/// task. Tasks must not throw.
class ThreadPool final : public Executor {
 public:
  static constexpr int kThreadsMax = 256;

  /// `threads` in all, the caller's included: 1 .. kThreadsMax.
  explicit ThreadPool(int threads);
  ~ThreadPool() override;
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  void for_ranges(int count, int least, RangeTask task) override;
  int threads() const override { return threads_; }
  void begin_shift() override;
  void end_shift() override { is_shift_ = false; }

  /// How many of its threads do, at this moment.
  int sleeping() const { return sleepers_; }

 private:
  /// A bit a range.
  using Ranges = std::uint64_t;

  int ranges_for(int count, int least) const;
  Ranges own_ranges(int thread) const;
  int place_of(int range) const;
  void serve(int thread);
  bool wait_for_work();
  void sleep();
  void take_ranges(Ranges own) noexcept;
  void wake_sleepers();

  // Of the present call; written while no range is open, read by whoever has taken one.
  const RangeTask* task_ = nullptr;
  int count_ = 0, ranges_ = 0;

  static constexpr std::size_t kLine = 64;          // of cache: what threads write lies apart
  alignas(kLine) std::atomic<Ranges> open_ = 0;     // that nobody has taken
  alignas(kLine) std::atomic<int> unfinished_ = 0;  // ranges
  alignas(kLine) std::atomic<int> sleepers_ = 0;
  std::atomic<bool> is_shift_ = false, is_ending_ = false;
  std::mutex mutex_;  // of those that fall asleep
  std::condition_variable work_;
  int threads_;
  std::vector<std::thread> workers_;
};

}  // namespace cradle
