#include "youbot_base_sim/sweep/run_schedule.h"

#include <thread>

#include "youbot_base_sim/integration/motion_integrator.h"

namespace youbot_base_sim {

std::vector<std::uint64_t> RunSchedule::take(std::size_t max_count) { return take(Lock(mutex_), max_count); }

std::vector<std::uint64_t> RunSchedule::take(const Lock&, std::size_t max_count) {
  std::vector<std::uint64_t> taken;
  for (; !stopping_ && taken.size() < max_count && may_begin_next(); ++next_) {
    if (!journal_.finished().contains(next_)) taken.push_back(next_);
  }
  return taken;
}

void RunSchedule::finish(const std::vector<Row>& rows) {
  const Lock lock(mutex_);
  for (const Row& row : rows) journal_.append(row);
  changed_.notify_all();
}

void RunSchedule::work(const MakeRow& make) {
  try {
    for (;;) {
      std::vector<std::uint64_t> taken;
      {
        Lock lock(mutex_);
        changed_.wait(lock, [&] { return stopping_ || next_ == runs_ || may_begin_next(); });
        taken = take(lock, 1);
        if (taken.empty() && (stopping_ || next_ == runs_)) return;
      }
      for (const std::uint64_t run : taken) finish({make(run, stopping_)});
    }
  } catch (const Stopped&) {
    stop();
  } catch (...) {
    const Lock lock(mutex_);
    if (!failure_) failure_ = std::current_exception();
    stopping_ = true;
    changed_.notify_all();
  }
}

void RunSchedule::stop() {
  const Lock lock(mutex_);
  stopping_ = true;
  changed_.notify_all();
}

bool RunSchedule::wait(std::chrono::milliseconds time) const {
  Lock lock(mutex_);
  return changed_.wait_for(lock, time, [&] { return ended(); });
}

void RunSchedule::check() const {
  const Lock lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

bool RunSchedule::finished() const {
  const Lock lock(mutex_);
  return journal_.tally().runs == runs_;
}

Tally RunSchedule::tally() const {
  const Lock lock(mutex_);
  return journal_.tally();
}

void work_on_threads(RunSchedule& schedule, const MakeRow& make, int threads, std::chrono::milliseconds interval,
                     const std::function<void()>& watch) {
  struct Crew {
    RunSchedule& schedule;
    std::vector<std::thread> threads;
    ~Crew() {
      for (std::thread& thread : threads) thread.join();
    }
  };
  {
    Crew crew{schedule, {}};
    try {
      for (int k = 0; k < threads; ++k) crew.threads.emplace_back([&] { schedule.work(make); });
      while (!schedule.wait(interval)) watch();
    } catch (...) {
      schedule.stop();
      throw;
    }
  }
  schedule.check();
}

}  // namespace youbot_base_sim
