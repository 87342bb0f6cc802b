#include "youbot_base_sim/sweep/ranks.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <future>
#include <mutex>
#include <stdexcept>

#include "youbot_base_sim/integration/motion_integrator.h"

#ifdef YOUBOT_BASE_SIM_MPI
#include <boost/mpi.hpp>
#include <boost/serialization/string.hpp>
#include <boost/serialization/utility.hpp>
#include <boost/serialization/vector.hpp>
#include <deque>
#include <list>
#include <thread>

namespace boost::serialization {

template <class Archive>
void serialize(Archive& archive, youbot_base_sim::Row& row, unsigned) {
  archive& row.run;
  archive& row.status;
  archive& row.text;
}

}  // namespace boost::serialization

#endif

namespace youbot_base_sim {

namespace {

using std::chrono::milliseconds;
using Runs = std::vector<std::uint64_t>;

constexpr milliseconds kWatch{100};  // between two calls of `watch`

/// Hands out the runs whose rows the journal lacks, and enters these as they come. For several threads at once.
class RunQueue {
 public:
  /// `watch` as Ranks::serve has it. All must outlive this.
  RunQueue(Journal& journal, const RowMaker& maker, const Ranks::Watch& watch)
      : journal_(journal), maker_(maker), watch_(watch) {}

  /// Finishes the runs, or what others leave of them, on `threads` more threads. Calls `look` every `interval` on this
  /// one. Throws what was thrown there or here, which stops all.
  void run(int threads, milliseconds interval, const std::function<void()>& look) {
    std::vector<std::future<void>> crew;  // which is waited for where this throws too
    try {
      for (int k = 0; k < threads; ++k) crew.push_back(std::async(std::launch::async, [&] { work(); }));
      while (!wait(interval)) look();
    } catch (...) {
      stop();
      throw;
    }
    for (std::future<void>& member : crew) member.get();
  }

  /// Calls `watch`, which may have nothing more handed out, and runs end early.
  void watch() {
    if (!watch_(tally())) stop();
  }

  /// The next runs, at most `max_count`; none where none are left, where it is to stop, or, unless this waits for them,
  /// while those that others work at hold up the rest (see FinishedRuns).
  Runs take(std::size_t max_count, bool waits = false) {
    Lock lock(mutex_);
    for (Runs taken;; changed_.wait(lock)) {
      for (; !stopping_ && taken.size() < max_count && next_ < journal_.runs(); ++next_) {
        if (!journal_.finished().has_room_for(next_)) break;
        if (!journal_.finished().contains(next_)) taken.push_back(next_);
      }
      if (!waits || !taken.empty() || stopping_ || next_ == journal_.runs()) return taken;
    }
  }

  /// Enters rows of runs that were taken. Throws OutputError.
  void finish(const std::vector<Row>& rows) {
    const Lock lock(mutex_);
    for (const Row& row : rows) journal_.append(row);
    changed_.notify_all();
  }

  Tally tally() const {
    const Lock lock(mutex_);
    return journal_.tally();
  }

 private:
  using Lock = std::unique_lock<std::mutex>;

  /// Takes runs and finishes them until there are no more or it is to stop.
  void work() {
    try {
      for (Runs taken = take(1, true); !taken.empty(); taken = take(1, true)) {
        finish({maker_.make(taken.front(), stopping_)});
      }
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

  /// Waits until all runs are finished or it is to stop, at most as long. Returns whether that is so.
  bool wait(milliseconds time) const {
    Lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return stopping_ || journal_.is_complete(); });
  }

  Journal& journal_;
  const RowMaker& maker_;
  const Ranks::Watch& watch_;
  std::uint64_t next_ = 0;  // all before were handed out or found finished
  std::atomic<bool> stopping_{false};
  mutable std::mutex mutex_;  // of all this, and of the journal but for its `sync`
  mutable std::condition_variable changed_;
};

#ifdef YOUBOT_BASE_SIM_MPI
namespace mpi = boost::mpi;
using Clock = std::chrono::steady_clock;
using Rows = std::pair<std::vector<Row>, bool>;  // of a batch, and whether there are no more of it

enum Tag { kRows = 1, kRuns = 2 };

// MPI's own waiting takes all of a core, which may be one that another rank simulates on.
constexpr milliseconds kPoll{1};
// As many runs are handed out at once as take this long, by the latest rate, so that messages are few; their rows come
// back as often, however long the rest of them take.
constexpr milliseconds kBatch{250};
constexpr double kMaxBatch = 100;
constexpr int kBatchesAhead = 2;  // at each rank: while it works at one, the next is on its way

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
    for (int k = 0; k < kBatchesAhead; ++k) {
      for (int rank = 1; rank < world_.size(); ++rank) hungry_.push_back(rank);
    }
    Clock::time_point watched = Clock::now(), counted = watched;
    std::uint64_t runs_then = journal.tally().runs;
    double batch = 1;
    RunQueue queue(journal, maker, watch);
    queue.run(1, kPoll, [&] {
      receive(queue);
      const Clock::time_point now = Clock::now();
      if (now - counted >= kBatch) {
        const std::uint64_t runs = queue.tally().runs;
        const double batches = std::chrono::duration<double>(now - counted) / kBatch;
        batch = std::clamp(static_cast<double>(runs - runs_then) / batches / world_.size(), 1.0, kMaxBatch);
        counted = now;
        runs_then = runs;
      }
      feed(queue, static_cast<std::size_t>(batch));
      if (now - watched < kWatch) return;
      watched = now;
      queue.watch();
    });
    if (!journal.is_complete()) return;  // stopped: the caller aborts
    for (int rank = 1; rank < world_.size(); ++rank) hand_out(rank, {});
    for (Handed& handed : handed_) handed.message.wait();
  }

  void work(const RowMaker& maker) override {
    const std::atomic<bool> stop{false};  // rank 0 aborts
    for (;;) {
      auto message = world_.iprobe(0, kRuns);
      for (; !message; message = world_.iprobe(0, kRuns)) std::this_thread::sleep_for(kPoll);
      Runs runs(static_cast<std::size_t>(message->count<std::uint64_t>().get()));
      world_.recv(0, kRuns, runs.data(), static_cast<int>(runs.size()));
      if (runs.empty()) return;
      Rows rows;
      Clock::time_point sent = Clock::now();
      for (const std::uint64_t run : runs) {
        rows.first.push_back(maker.make(run, stop));
        rows.second = run == runs.back();
        if (!rows.second && Clock::now() - sent < kBatch) continue;
        world_.send(0, kRows, rows);
        rows.first.clear();
        sent = Clock::now();
      }
    }
  }

  [[noreturn]] void abort(int status) const override {
    mpi::environment::abort(status);
    std::terminate();
  }

 private:
  /// Runs that were sent to a rank.
  struct Handed {
    Runs runs;
    mpi::request message;
  };

  // Does not wait until they are received: the rank may be waiting for its rows to be.
  void hand_out(int rank, Runs runs) {
    handed_.remove_if([](Handed& handed) { return handed.message.test().has_value(); });
    Handed& handed = handed_.emplace_back(Handed{std::move(runs), {}});
    handed.message = world_.isend(rank, kRuns, handed.runs.data(), static_cast<int>(handed.runs.size()));
  }

  void receive(RunQueue& queue) {
    while (const auto message = world_.iprobe(mpi::any_source, kRows)) {
      Rows rows;
      world_.recv(message->source(), kRows, rows);
      queue.finish(rows.first);
      if (rows.second) hungry_.push_back(message->source());
    }
  }

  void feed(RunQueue& queue, std::size_t batch) {
    while (!hungry_.empty()) {
      Runs runs = queue.take(batch);
      if (runs.empty()) return;
      hand_out(hungry_.front(), std::move(runs));
      hungry_.pop_front();
    }
  }

  mpi::environment environment_;
  mpi::communicator world_;
  std::list<Handed> handed_;
  std::deque<int> hungry_;  // ranks, once for each batch that they could take
};
#endif

/// Whether mpirun, or another launcher that MPI knows, has started this process.
bool launched_by_mpi() {
  constexpr const char* kVariables[] = {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"};
  return std::any_of(std::begin(kVariables), std::end(kVariables), [](const char* name) { return std::getenv(name); });
}

}  // namespace

void Ranks::serve(Journal& journal, const RowMaker& maker, int threads, const Watch& watch) {
  RunQueue queue(journal, maker, watch);
  queue.run(threads, kWatch, [&] { queue.watch(); });
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
