#include "youbot_base_sim/sweep/run_schedule.h"

#include <future>

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

void RunSchedule::run(const RowMaker& maker, int threads, std::chrono::milliseconds interval,
                      const std::function<void()>& watch) {
  std::vector<std::future<void>> crew;  // which is waited for where this throws too
  try {
    for (int k = 0; k < threads; ++k) crew.push_back(std::async(std::launch::async, [&] { work(maker); }));
    while (!wait(interval)) watch();
  } catch (...) {
    stop();
    throw;
  }
  for (std::future<void>& member : crew) member.get();
}

void RunSchedule::work(const RowMaker& maker) {
  try {
    for (;;) {
      std::vector<std::uint64_t> taken;
      {
        Lock lock(mutex_);
        changed_.wait(lock, [&] { return stopping_ || next_ == runs_ || may_begin_next(); });
        taken = take(lock, 1);
        if (taken.empty() && (stopping_ || next_ == runs_)) return;
      }
      for (const std::uint64_t run : taken) finish({maker.make(run, stopping_)});
    }
  } catch (const Stopped&) {
    stop();
  } catch (...) {
    stop();
    throw;
  }
}

void RunSchedule::stop() {
  const Lock lock(mutex_);
  stopping_ = true;
  changed_.notify_all();
}

bool RunSchedule::wait(std::chrono::milliseconds time) const {
  Lock lock(mutex_);
  return changed_.wait_for(lock, time, [&] { return stopping_ || journal_.tally().runs == runs_; });
}

bool RunSchedule::finished() const {
  const Lock lock(mutex_);
  return journal_.tally().runs == runs_;
}

Tally RunSchedule::tally() const {
  const Lock lock(mutex_);
  return journal_.tally();
}

}  // namespace youbot_base_sim
