#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <vector>

namespace youbot_base_sim {

/// Calls work(k) for k = 0 to n - 1 on this thread and at most `threads` - 1 others. The first exception sets `stop`,
/// after which no k begins, and is rethrown. Calls `watch`, which may throw, each 50 ms while others still work.
template <class Work, class Watch>
void share(std::size_t n, int threads, std::atomic<bool>& stop, const Work& work, const Watch& watch) {
  std::exception_ptr error;
  const auto attempt = [&](const auto& task) {
    try {
      task();
    } catch (...) {
      if (!stop.exchange(true)) error = std::current_exception();
    }
  };
  std::atomic<std::size_t> next{0};
  const auto take_all = [&] {
    for (std::size_t k = next++; k < n && !stop; k = next++) work(k);
  };
  std::vector<std::future<void>> others;
  for (std::size_t k = 1; k < std::min(n, static_cast<std::size_t>(threads)); ++k)
    others.push_back(std::async(std::launch::async, [&] { attempt(take_all); }));
  attempt(take_all);
  for (const auto& other : others) {
    while (other.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) attempt(watch);
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace youbot_base_sim
