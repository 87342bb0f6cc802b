#include "youbot_base_sim/sweep/ranks.h"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

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

#ifdef YOUBOT_BASE_SIM_MPI
namespace mpi = boost::mpi;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;
using Runs = std::vector<std::uint64_t>;
using Rows = std::pair<std::vector<Row>, bool>;  // of a batch, and whether there are no more of it

enum Tag { kRows = 1, kRuns = 2 };

// MPI's own waiting takes all of a core, which may be one that another rank simulates on.
constexpr milliseconds kPoll{1};
// As many runs are handed out at once as take this long, by the latest rate, so that messages are few; their rows come
// back as often, however long the rest of them take.
constexpr std::chrono::milliseconds kBatch{250};
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

  void serve(RunSchedule& schedule, const RowMaker& maker, int threads, milliseconds interval,
             const std::function<void()>& watch) override {
    if (size() == 1) return Ranks::serve(schedule, maker, threads, interval, watch);
    hungry_.clear();
    for (int k = 0; k < kBatchesAhead; ++k) {
      for (int rank = 1; rank < world_.size(); ++rank) hungry_.push_back(rank);
    }
    Clock::time_point watched = Clock::now(), counted = watched;
    std::uint64_t runs_then = schedule.tally().runs;
    double batch = 1;
    schedule.run(maker, 1, kPoll, [&] {
      receive(schedule);
      const Clock::time_point now = Clock::now();
      if (now - counted >= kBatch) {
        const std::uint64_t runs = schedule.tally().runs;
        const double batches = std::chrono::duration<double>(now - counted) / kBatch;
        batch = std::clamp(static_cast<double>(runs - runs_then) / batches / world_.size(), 1.0, kMaxBatch);
        counted = now;
        runs_then = runs;
      }
      feed(schedule, static_cast<std::size_t>(batch));
      if (now - watched < interval) return;
      watched = now;
      watch();
    });
    if (!schedule.finished()) return;  // stopped: the caller of `stop` aborts
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

  void receive(RunSchedule& schedule) {
    while (const auto message = world_.iprobe(mpi::any_source, kRows)) {
      Rows rows;
      world_.recv(message->source(), kRows, rows);
      schedule.finish(rows.first);
      if (rows.second) hungry_.push_back(message->source());
    }
  }

  void feed(RunSchedule& schedule, std::size_t batch) {
    while (!hungry_.empty()) {
      Runs runs = schedule.take(batch);
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
