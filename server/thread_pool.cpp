#include "server/thread_pool.h"

#include <algorithm>
#include <cassert>

namespace cradle {
namespace {

/// More than one, so that a thread which gets heavy indices does not keep the others waiting.
constexpr int kRangesPerThread = 4;

}  // namespace

ThreadPool::ThreadPool(int threads) {
  assert(threads >= 1 && threads <= kThreadsMax);
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { serve(); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  work_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void ThreadPool::for_ranges(int count, const Task& task) {
  if (count <= 0) return;
  if (workers_.empty()) return task(0, count);
  std::unique_lock lock(mutex_);
  task_ = &task;
  count_ = count;
  range_ = std::max(1, count / (kRangesPerThread * (static_cast<int>(workers_.size()) + 1)));
  next_ = 0;
  work_.notify_all();
  take_ranges(lock);
  done_.wait(lock, [this] { return running_ == 0; });
}

void ThreadPool::serve() {
  std::unique_lock lock(mutex_);
  for (;;) {
    work_.wait(lock, [this] { return is_ending_ || next_ < count_; });
    if (is_ending_) return;
    take_ranges(lock);
    if (running_ == 0) done_.notify_one();
  }
}

void ThreadPool::take_ranges(std::unique_lock<std::mutex>& lock) noexcept {
  while (next_ < count_) {
    const Task& task = *task_;
    const int begin = next_;
    const int end = begin + std::min(range_, count_ - begin);
    next_ = end;
    ++running_;
    lock.unlock();
    task(begin, end);
    lock.lock();
    --running_;
  }
}

}  // namespace cradle
