// Threads of this process and of another one, that sleep, work, begin and end.

#include "youbot_base_sim/lockstep/process.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <functional>
#include <list>
#include <mutex>
#include <thread>

namespace youbot_base_sim {
namespace {

/// A thread that sleeps until it is to work, and works until it is to sleep.
class Worker {
 public:
  ~Worker() {
    set(done_, true);
    thread_.join();
  }

  void work() { set(works_, true); }
  void rest() { set(works_, false); }

 private:
  void set(std::atomic<bool>& what, bool value) {
    const std::lock_guard<std::mutex> lock(mutex_);
    what = value;
    changed_.notify_one();
  }

  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!done_) {
      changed_.wait(lock, [this] { return works_ || done_; });
      lock.unlock();
      while (works_ && !done_) continue;
      lock.lock();
    }
  }

  std::atomic<bool> works_{false}, done_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::thread thread_{[this] { run(); }};
};

bool happens(const std::function<bool()>& event) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!event()) {
    if (std::chrono::steady_clock::now() > limit) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  return true;
}

/// A worker is never seen to sleep; once it rests, it is.
void expect_seen(Worker& worker, Process& process) {
  ASSERT_TRUE(happens([&] { return process.rests(); }));
  const std::uint64_t before = process.work_so_far();
  worker.work();
  for (int k = 0; k < 100; ++k) ASSERT_FALSE(process.rests()) << k;
  worker.rest();
  ASSERT_TRUE(happens([&] { return process.rests(); }));
  EXPECT_GT(process.work_so_far(), before);
}

TEST(Process, ShowsThreadsThatBeginAndEnd) {
  Process process(getpid());
  EXPECT_TRUE(process.rests()) << "alone, the caller does not count";
  std::list<Worker> workers(2);
  for (int k = 0; k < 20; ++k) {
    expect_seen(workers.back(), process);
    workers.emplace_back();  // as many as before, the last one new
    workers.pop_front();
  }
}

TEST(Process, ShowsMoreThreadsThanFilesThatStayOpen) {
  Process process(getpid());
  std::list<Worker> workers(200);
  expect_seen(workers.back(), process);
  expect_seen(workers.front(), process);
}

/// Lets a worker run and come to rest.
void run_once(Worker& worker, Process& process) {
  const std::uint64_t before = process.work_so_far();
  worker.work();
  ASSERT_TRUE(happens([&] { return process.work_so_far() != before; }));
  worker.rest();
  ASSERT_TRUE(happens([&] { return process.rests(); }));
}

TEST(Process, LearnsWhichThreadsPoll) {
  constexpr auto kPoll = std::chrono::milliseconds(1);
  Process process(getpid());
  Worker worker;
  ASSERT_TRUE(happens([&] { return process.rests(); }));
  process.mark();
  EXPECT_TRUE(process.has_late_poll()) << "a new thread may be about to poll";
  process.learn_polls(kPoll);
  process.mark();
  EXPECT_FALSE(process.has_late_poll()) << "it does not";
  process.learn_polls(kPoll);
  for (int k = 0; k < 5; ++k) {
    process.mark();
    EXPECT_EQ(process.has_late_poll(), k > 1) << "it has polled " << k << " times";
    run_once(worker, process);
    EXPECT_FALSE(process.has_late_poll()) << "it has run";
    process.learn_polls(kPoll);
  }
  for (int k = 0; k < 4; ++k) {
    process.mark();
    EXPECT_TRUE(process.has_late_poll()) << "late " << k << " times, it is waited for";
    process.learn_polls(kPoll);
  }
  process.mark();
  EXPECT_FALSE(process.has_late_poll());
  for (int k = 0; k < 5; ++k) {
    process.mark();
    EXPECT_FALSE(process.has_late_poll()) << "it runs, but too seldom for one that polls";
    run_once(worker, process);
    process.learn_polls(std::chrono::seconds(1));
  }
}

TEST(Process, TakesOneThatBeginsToSleepForOneThatPolls) {
  std::atomic<bool> sleeps{false}, done{false};
  std::mutex mutex;
  std::condition_variable changed;
  std::thread thread([&] {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return sleeps.load(); });
    lock.unlock();
    while (!done) std::this_thread::sleep_for(std::chrono::milliseconds(200));
  });
  Process process(getpid());
  const auto has_late_poll = [&] { return process.rests() && process.mark() && process.has_late_poll(); };
  ASSERT_TRUE(happens([&] { return process.rests(); }));
  for (int k = 0; k < 3; ++k) {
    process.mark();
    process.learn_polls(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(has_late_poll());
  sleeps = true;
  changed.notify_one();
  EXPECT_TRUE(happens(has_late_poll));
  done = true;
  thread.join();
}

TEST(Process, ShowsAnotherProcess) {
  const pid_t child = fork();
  if (child == 0) {
    while (true) pause();
  }
  Process process(child);
  EXPECT_TRUE(happens([&] { return process.rests(); }));
  EXPECT_FALSE(process.is_stopped());
  kill(child, SIGSTOP);
  EXPECT_TRUE(happens([&] { return process.is_stopped(); }));
  EXPECT_FALSE(process.rests());
  kill(child, SIGCONT);
  EXPECT_TRUE(happens([&] { return process.rests(); }));
  kill(child, SIGSTOP);
  EXPECT_TRUE(happens([&] { return process.is_stopped(); }));
  kill(child, SIGKILL);
  EXPECT_TRUE(happens([&] { return process.rests(); })) << "it has ended, and its parent has not taken notice";
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(process.rests());
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(process.rests());
  EXPECT_TRUE(Process(child).rests()) << "there is none";
}

}  // namespace
}  // namespace youbot_base_sim
