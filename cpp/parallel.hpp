// Static and dynamic loops over threads. Work items never share output, so results do not depend on the
// number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace partwright {

inline int thread_count(int requested) {
  if (requested > 0) return requested;
  // Asked once: the answer is read from a file, which takes as long as many a loop.
  static const int hardware = std::max(1, int(std::thread::hardware_concurrency()));
  return hardware;
}

// Calls work(item, state) for every item, each on one thread, in no particular order. Each thread makes a state of
// its own, once.
template <typename Make, typename Work>
void parallel_for(int64_t items, int threads, Make make, Work work) {
  threads = int(std::min<int64_t>(thread_count(threads), items));
  std::atomic<int64_t> next{0};
  auto run = [&] {
    auto state = make();
    for (int64_t i = next++; i < items; i = next++) work(i, state);
  };
  std::vector<std::thread> pool;
  for (int i = 1; i < threads; ++i) pool.emplace_back(run);
  run();
  for (auto& thread : pool) thread.join();
}

// The same for work without a state.
template <typename Work>
void parallel_for(int64_t items, int threads, Work work) {
  parallel_for(items, threads, [] { return 0; }, [&](int64_t i, int) { work(i); });
}

}  // namespace partwright
