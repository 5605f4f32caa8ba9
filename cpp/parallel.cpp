#include "parallel.hpp"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>

#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#endif

namespace partwright {
namespace {

int cores() {
  // Asked once: the answer is read from a file, which takes as long as many a loop.
  static const int found = std::max(1, int(std::thread::hardware_concurrency()));
  return found;
}

// A call, in the frame of its caller until none is at it.
struct Call {
  const std::function<void()>& run;
  int wanted;       // threads, beside the caller's
  int at_it = 0;    // of them
  std::exception_ptr failure = nullptr;
  std::condition_variable done = {};
};

// Threads that wait for calls. They are as many as have been of use at once, and never more than cores, unless a single
// call asks for more.
class Helpers {
 public:
  void help(int threads, const std::function<void()>& run) {
    Call call{run, threads - 1};
    std::unique_lock<std::mutex> lock(mutex_);
    most_ = std::max(most_, threads);
    calls_.push_back(&call);
    wanted_ += call.wanted;
    ++callers_;
    engage(lock);
    std::exception_ptr failure = nullptr;
    try {
      run();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    --callers_;
    if (call.wanted > 0) {
      wanted_ -= call.wanted;
      calls_.erase(std::find(calls_.begin(), calls_.end(), &call));
    }
    if (wanted_ > 0) {  // by others, which may have this thread's core
      engage(lock);
      lock.lock();
    }
    call.done.wait(lock, [&] { return call.at_it == 0; });
    lock.unlock();
    if (!failure) failure = call.failure;
    if (failure) std::rethrow_exception(failure);
  }

 private:
  int free_cores() const { return std::max(cores(), most_) - callers_ - helping_; }

  // Wakes threads for the calls there are, and starts those that are lacking. Unlocks.
  void engage(std::unique_lock<std::mutex>& lock) {
    const int useful = std::min(free_cores(), wanted_);
    while (idle_ < useful && start()) {
    }
    const int woken = std::min(useful, idle_);
    lock.unlock();
    for (int i = 0; i < woken; ++i) work_.notify_one();
  }

  bool start() {
    try {
      std::thread([this] { stay(); }).detach();
      ++idle_;
      return true;
    } catch (const std::system_error&) {  // no more are to be had: the callers do the work
      return false;
    }
  }

  [[noreturn]] void stay() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      work_.wait(lock, [this] { return wanted_ > 0 && free_cores() > 0; });
      Call& call = *calls_.front();
      calls_.pop_front();
      if (--call.wanted > 0) calls_.push_back(&call);  // after the others, so that each has a share
      --wanted_;
      --idle_;
      ++call.at_it;
      ++helping_;
      lock.unlock();
      std::exception_ptr failure = nullptr;
      try {
        call.run();
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      --helping_;
      ++idle_;
      if (failure && !call.failure) call.failure = failure;
      if (--call.at_it == 0) call.done.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable work_;
  std::deque<Call*> calls_;  // that want helpers
  int wanted_ = 0;           // by all of them
  int callers_ = 0, helping_ = 0, idle_ = 0;
  int most_ = 1;  // threads that any call has asked for
};

// Never deleted: its threads may be waiting when the process ends.
Helpers* helpers = nullptr;

void begin() { helpers = new Helpers; }

Helpers& all() {
  static const bool begun = [] {
    begin();
#if defined(__unix__) || defined(__APPLE__)
    pthread_atfork(nullptr, nullptr, begin);  // a forked process has none of the threads
#endif
    return true;
  }();
  (void)begun;
  return *helpers;
}

}  // namespace

int thread_count(int requested) { return requested > 0 ? requested : cores(); }

void together(int threads, const std::function<void()>& run) { all().help(threads, run); }

}  // namespace partwright
