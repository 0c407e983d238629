/// An Executor with threads of its own.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "server/collision/executor.h"

namespace cradle {

/// Threads that sleep between calls. for_ranges() takes part itself, and returns when all is done;
/// it may be called from one thread at a time, and not from within a task. Tasks must not throw.
class ThreadPool final : public Executor {
 public:
  static constexpr int kThreadsMax = 256;

  /// `threads` in all, the caller's included: 1 .. kThreadsMax.
  explicit ThreadPool(int threads);
  ~ThreadPool() override;
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  using Task = std::function<void(int begin, int end)>;
  void for_ranges(int count, const Task& task) override;

 private:
  void serve();
  void take_ranges(std::unique_lock<std::mutex>& lock) noexcept;

  std::mutex mutex_;  // guards all that follows but workers_
  std::condition_variable work_, done_;
  const Task* task_ = nullptr;
  int count_ = 0, range_ = 1;  // of the present call: indices in all, and in a range
  int next_ = 0;               // index that begins the next range
  int running_ = 0;            // ranges taken and not finished
  bool is_ending_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace cradle
