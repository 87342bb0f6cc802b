#include "youbot_base_sim/sweep/ranks.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <future>
#include <mutex>
#include <optional>
#include <stdexcept>

#include "youbot_base_sim/integration/motion_integrator.h"

#ifdef YOUBOT_BASE_SIM_MPI
#include <boost/mpi.hpp>
#include <boost/serialization/string.hpp>
#include <deque>
#include <list>
#include <thread>
#endif

namespace youbot_base_sim {

namespace {

using std::chrono::milliseconds;

/// Hands out the runs that the journal lacks and appends their rows. Used by several threads at once.
class RunQueue {
 public:
  /// `watch` as in Ranks::serve. All must outlive this.
  RunQueue(Journal& journal, const RowMaker& maker, const Ranks::Watch& watch)
      : journal_(journal), maker_(maker), watch_(watch), next_(journal.runs().begin) {}

  /// Finishes runs on `threads` more threads. Calls `exchange` and `watch` each `interval` here. Rethrows exceptions.
  void run(int threads, milliseconds interval, const std::function<void()>& exchange) {
    std::vector<std::future<void>> crew;  // joined where this throws, too
    try {
      for (int k = 0; k < threads; ++k) crew.push_back(std::async(std::launch::async, [&] { work(); }));
      while (!wait(interval)) {
        exchange();
        if (!watch_(tally())) stop();
      }
    } catch (...) {
      stop();
      throw;
    }
    for (std::future<void>& member : crew) member.get();
  }

  /// The next run; none after the last, after a stop or, unless this `waits`, while the journal has no room for it.
  std::optional<std::uint64_t> take(bool waits) {
    Lock lock(mutex_);
    for (;; changed_.wait(lock)) {
      while (journal_.finished().contains(next_)) ++next_;
      if (stopping_ || next_ >= journal_.runs().end) return std::nullopt;
      if (journal_.finished().has_room_for(next_)) return next_++;
      if (!waits) return std::nullopt;
    }
  }

  /// Appends the row of a run that was taken. Throws OutputError.
  void finish(const Row& row) {
    const Lock lock(mutex_);
    journal_.append(row);
    changed_.notify_all();
  }

 private:
  using Lock = std::unique_lock<std::mutex>;

  void work() {
    try {
      while (const auto run = take(true)) finish(maker_.make(*run, stopping_));
    } catch (const Stopped&) {
      stop();
    } catch (...) {
      stop();
      throw;
    }
  }

  void stop() {
    const Lock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }

  /// Waits at most this long until all runs are finished or it stops. Returns whether that is so.
  bool wait(milliseconds time) {
    Lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return stopping_ || journal_.is_complete(); });
  }

  Tally tally() {
    const Lock lock(mutex_);
    return journal_.tally();
  }

  Journal& journal_;
  const RowMaker& maker_;
  const Ranks::Watch& watch_;
  std::uint64_t next_;  // all before were handed out or found finished
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;  // of all this, and of the journal but for its `sync`
  std::condition_variable changed_;
};

#ifdef YOUBOT_BASE_SIM_MPI
namespace mpi = boost::mpi;

enum Tag { kRow = 1, kRun = 2 };

constexpr std::uint64_t kNoRun = -1;  // ends a rank's work
constexpr int kRunsAhead = 2;         // at each rank: while it makes one, the next is on its way
constexpr milliseconds kPoll{1};      // MPI's own waiting takes all of a core, on which another rank may simulate

// Rank 0 sends runs, and each other rank returns a row a run. Neither waits for the other, which may be amid a run.
class MpiRanks : public Ranks {
 public:
  MpiRanks(int& argc, char**& argv) : environment_(argc, argv, mpi::threading::funneled) {}

  int rank() const override { return world_.rank(); }
  int size() const override { return world_.size(); }

  std::vector<std::string> gather(const std::string& text) const override {
    std::vector<std::string> all;
    mpi::all_gather(world_, text, all);
    return all;
  }

  void serve(Journal& journal, const RowMaker& maker, int threads, const Watch& watch) override {
    if (size() == 1) return Ranks::serve(journal, maker, threads, watch);
    std::list<std::pair<std::uint64_t, mpi::request>> sent;  // runs
    std::deque<int> idle;                                    // ranks, once for each run that they could take
    for (int k = 0; k < kRunsAhead; ++k) {
      for (int rank = 1; rank < size(); ++rank) idle.push_back(rank);
    }
    RunQueue queue(journal, maker, watch);
    queue.run(1, kPoll, [&] {
      while (const auto message = world_.iprobe(mpi::any_source, kRow)) {
        Row row;
        world_.recv(message->source(), kRow, row);
        queue.finish(row);
        idle.push_back(message->source());
      }
      for (; !idle.empty(); idle.pop_front()) {
        const auto run = queue.take(false);
        if (!run) return;
        sent.remove_if([](auto& message) { return message.second.test().has_value(); });
        auto& [number, request] = sent.emplace_back(*run, mpi::request());
        request = world_.isend(idle.front(), kRun, number);
      }
    });
    if (!journal.is_complete()) return;  // stopped: the caller aborts
    for (int rank = 1; rank < size(); ++rank) world_.send(rank, kRun, kNoRun);
    for (auto& message : sent) message.second.wait();
  }

  void work(const RowMaker& maker) override {
    const std::atomic<bool> stop{false};  // rank 0 aborts
    const auto wait = [](mpi::request& message) {
      while (message.active() && !message.test()) std::this_thread::sleep_for(kPoll);
    };
    std::uint64_t next = kNoRun;
    for (mpi::request received = world_.irecv(0, kRun, next), sent;;) {
      wait(received);
      const std::uint64_t run = next;
      if (run == kNoRun) return wait(sent);
      received = world_.irecv(0, kRun, next);
      const Row row = maker.make(run, stop);
      wait(sent);
      sent = world_.isend(0, kRow, row);
    }
  }

  void abort(int status) const override { mpi::environment::abort(status); }

 private:
  mpi::environment environment_;
  mpi::communicator world_;
};
#endif

/// True if mpirun, or another launcher that MPI knows, has started this process.
bool launched_by_mpi() {
  constexpr const char* kVariables[] = {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"};
  return std::any_of(std::begin(kVariables), std::end(kVariables), [](const char* name) { return std::getenv(name); });
}

}  // namespace

void Ranks::serve(Journal& journal, const RowMaker& maker, int threads, const Watch& watch) {
  RunQueue(journal, maker, watch).run(threads, milliseconds(100), [] {});
}

std::unique_ptr<Ranks> join_ranks([[maybe_unused]] int& argc, [[maybe_unused]] char**& argv) {
  if (!launched_by_mpi()) return std::make_unique<Ranks>();
#ifdef YOUBOT_BASE_SIM_MPI
  return std::make_unique<MpiRanks>(argc, argv);
#else
  throw std::runtime_error(
      "this sweep was built without MPI: start it without mpirun, or build it once more where libboost-mpi-dev is");
#endif
}

}  // namespace youbot_base_sim
