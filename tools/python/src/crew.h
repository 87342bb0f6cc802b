#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <future>
#include <thread>
#include <vector>

namespace youbot_base_sim {

/// Threads that work without the GIL. The calling one works too, and looks out for Python's signals.
class Crew {
 public:
  explicit Crew(int threads) : threads_(threads) {}

  /// Calls work(k) for k = 0 to n - 1. Rethrows the first exception, after which no k begins.
  template <class Work>
  void for_each(std::size_t n, const Work& work) {
    const pybind11::gil_scoped_release release;
    std::exception_ptr error;
    const auto attempt = [&](const auto& task) {
      try {
        task();
      } catch (...) {
        if (!stopping_.exchange(true)) error = std::current_exception();
      }
    };
    std::atomic<std::size_t> next{0};
    const auto take_all = [&] {
      for (std::size_t k = next++; k < n && !stopping_; k = next++) work(k);
    };
    caller_ = std::this_thread::get_id();
    stopping_ = false;
    std::vector<std::future<void>> others;
    for (std::size_t k = 1; k < std::min(n, static_cast<std::size_t>(threads_)); ++k) {
      others.push_back(std::async(std::launch::async, [&] { attempt(take_all); }));
    }
    attempt(take_all);
    for (const auto& other : others) {
      while (other.wait_for(kInterval) != std::future_status::ready) attempt([&] { look(); });
    }
    if (error) std::rethrow_exception(error);
  }

  /// To be called by work that takes long: throws what Python's signal handlers raise, and once another thread threw.
  void look() {
    if (stopping_) throw Interrupted();
    if (std::this_thread::get_id() != caller_ || Clock::now() - looked_ < kInterval) return;
    const pybind11::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
    looked_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Interrupted {};
  static constexpr std::chrono::milliseconds kInterval{50};  // between two looks

  int threads_;
  std::thread::id caller_;
  Clock::time_point looked_;  // by the caller
  std::atomic<bool> stopping_{false};
};

}  // namespace youbot_base_sim
