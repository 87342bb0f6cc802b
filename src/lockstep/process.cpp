#include "youbot_base_sim/lockstep/process.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>

namespace youbot_base_sim {

namespace {

void throw_if_too_many_files(int error) {
  if (error == EMFILE || error == ENFILE) throw std::system_error(error, std::generic_category(), "/proc");
}

/// A small file of /proc, read again and again: it stays open, for opening it takes four times as long as reading.
class File {
 public:
  explicit File(const std::string& path) : file_(std::fopen(path.c_str(), "re"), &std::fclose) {
    if (!file_) throw_if_too_many_files(errno);
  }

  /// The text; empty if what it is about has ended.
  template <std::size_t n>
  char* read(char (&text)[n]) const {
    const ssize_t size = file_ ? pread(fileno(file_.get()), text, n - 1, 0) : 0;
    text[size > 0 ? size : 0] = '\0';
    return text;
  }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

/// Processor time by a process's clock, ns, without what its threads run just now; 0 if it has ended. Takes 0.5 us.
std::uint64_t processor_time(clockid_t clock) {
  timespec time{};
  if (clock_gettime(clock, &time) != 0) return 0;
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(time.tv_nsec);
}

/// True where wchan is "0" from the moment a thread is woken, not only once the thread can run: since Linux 5.16.
bool wchan_shows_waking() {
  utsname system{};
  int version = 0, patchlevel = 0;
  uname(&system);
  std::sscanf(system.release, "%d.%d", &version, &patchlevel);
  return 100 * version + patchlevel >= 516;
}

}  // namespace

class Process::Thread {
 public:
  /// `folder`: its own in /proc.
  Thread(pid_t id, const std::string& folder)
      : id_(id), folder_(folder), wchan_(folder + "/wchan"), schedstat_(folder + "/schedstat") {}

  pid_t id() const { return id_; }

  /// A letter as in /proc; X: it has ended.
  char state() const {
    char text[512];
    const File stat(folder_ + "/stat");
    const char* state = std::strrchr(stat.read(text), ')');
    return state ? state[2] : 'X';
  }

  /// True if it waits for something or has ended. A thread that was woken, or preempted on its way to sleep, waits
  /// nowhere. A place in the kernel puts threads into one state: that is read once for each place.
  bool sleeps(bool process_has_run) {
    static const bool kShowsWaking = wchan_shows_waking();
    thread_local std::set<std::string> places;  // where threads sleep
    char text[64];
    place_ = wchan_.read(text);
    const bool waits = place_ != "0";
    if (waits && kShowsWaking && places.count(place_) > 0) return true;
    if (!waits && process_has_run) return false;  // one that has ended does not work
    const char now = state();
    const bool is_asleep = waits && (now == 'S' || now == 'I');
    if (is_asleep && place_ == wchan_.read(text)) places.insert(place_);
    return is_asleep || now == 'Z' || now == 'X';
  }

  /// True if, when last looked at, it waited for time or for another thread of its process.
  bool waits_within() const { return naps() || place_.find("futex") != std::string::npos; }

  /// True if it has been found to be gone.
  bool has_ended() const { return place_.empty(); }

  /// Grows whenever it runs: time on a processor, time waiting for one, and how often it got one.
  std::uint64_t work_so_far() const {
    const auto [on_processor, waiting, runs] = scheduled();
    return on_processor + waiting + runs;
  }

  /// Polls wait in a sleep of their own or at a condition. One that begins to sleep may be about to poll. Returns true
  /// if it polls or sleeps so.
  bool mark(bool learns) {
    if (place_ == "0") return polls_ || naps_;
    const bool has_napped = std::exchange(naps_, naps());
    if (has_napped != naps_) poll_score_ = naps_ ? kPollScore : 0;
    is_marked_ = waits_within() && (learns || poll_score_ > 0);
    if (is_marked_) marked_ = scheduled();
    polls_ = is_marked_ && poll_score_ >= kPollScore;
    return polls_ || naps_;
  }

  void learn_polls(std::chrono::nanoseconds since) {
    if (!is_marked_) return;
    const auto [on_processor, waiting, runs] = scheduled();
    const std::chrono::nanoseconds waited(waiting - marked_[1]);  // for a processor
    const bool has_polled = (runs - marked_[2]) * kBetweenPolls + waited >= since;
    if (!has_polled && !sleeps(true)) return;  // it still waits for one
    poll_score_ = std::clamp(poll_score_ + (has_polled ? 1 : -1), 0, kMaxPollScore);
  }

  bool has_late_poll() const { return polls_ && scheduled()[2] == marked_[2]; }

 private:
  bool naps() const { return place_.find("nanosleep") != std::string::npos; }

  static constexpr auto kBetweenPolls = std::chrono::milliseconds(10);  // at most; most sleep for one
  static constexpr int kPollScore = 2, kMaxPollScore = 5;               // of poll_score_

  /// Nanoseconds on a processor and waiting for one, and number of runs; 0 if it has ended.
  std::array<std::uint64_t, 3> scheduled() const {
    char text[128];
    std::array<std::uint64_t, 3> fields{};
    char* number = schedstat_.read(text);
    for (std::uint64_t& field : fields) field = std::strtoull(number, &number, 10);
    return fields;
  }

  pid_t id_;
  std::string folder_;
  File wchan_, schedstat_;
  std::string place_ = "0";                // where in the kernel it waits; "0": nowhere; empty: it has ended
  std::array<std::uint64_t, 3> marked_{};  // at the mark
  bool naps_ = false, is_marked_ = false, polls_ = false;
  int poll_score_ = kPollScore;  // marks after which it has polled, less those after which it has not
};

Process::Process(pid_t id) : id_(id), is_own_(id == getpid()) { clock_getcpuclockid(id, &clock_); }
Process::Process(Process&&) noexcept = default;
Process& Process::operator=(Process&&) noexcept = default;
Process::~Process() = default;

bool Process::rests() {
  const auto still_works = [this] { return awake_ < threads_.size() && !threads_[awake_].sleeps(true); };
  if (is_own_ && still_works()) return false;
  const std::uint64_t work = work_so_far();
  const bool has_run = std::exchange(work_, work) != work || threads_.empty();
  const bool has_rested = std::exchange(rested_, false) && !has_run && !is_own_;  // this thread may wake its own
  if (has_run && (find_threads(), still_works())) return false;
  for (awake_ = 0; awake_ < threads_.size(); ++awake_)
    if (!(has_rested && threads_[awake_].waits_within()) && !threads_[awake_].sleeps(has_run)) return false;
  if (some_have_ended()) return find_threads(), false;  // others may have begun
  return rested_ = work_so_far() == work;
}

bool Process::is_stopped() const {
  const char state = threads_.empty() ? 'X' : threads_.front().state();
  return state == 'T' || state == 't';  // by a signal, by a debugger
}

std::size_t Process::threads() const { return threads_.size(); }

std::uint64_t Process::work_so_far() {
  if (!is_own_) return processor_time(clock_);
  find_threads();
  std::uint64_t work = 0;
  for (const Thread& thread : threads_) work += thread.work_so_far();
  return work;
}

bool Process::mark(bool learns) {
  bool polls = false;
  for (Thread& thread : threads_) polls |= thread.mark(learns);
  return polls;
}

void Process::learn_polls(std::chrono::nanoseconds since) {
  rested_ = false;  // a thread that its timeout wakes works before its time on a processor counts
  for (Thread& thread : threads_) thread.learn_polls(since);
}

bool Process::has_late_poll() const {
  return std::any_of(threads_.begin(), threads_.end(), std::mem_fn(&Thread::has_late_poll));
}

bool Process::some_have_ended() const {
  return std::any_of(threads_.begin(), threads_.end(), std::mem_fn(&Thread::has_ended));
}

void Process::find_threads() {
  namespace fs = std::filesystem;
  const std::string folder = fmt::format("/proc/{}/task", id_);
  struct stat links {};  // two more than threads; if one has come for one that has gone, that has ended
  const std::size_t others = is_own_ ? 3 : 2;
  const bool is_known = stat(folder.c_str(), &links) == 0 && links.st_nlink == threads_.size() + others;
  if (is_known && !some_have_ended()) return;
  std::error_code ended;
  std::ptrdiff_t count = 0;
  for (fs::directory_iterator entry(folder, ended), last; entry != last; entry.increment(ended)) {
    const pid_t id = std::atoi(entry->path().filename().c_str());
    if (id == gettid()) continue;
    const auto known = std::find_if(threads_.begin() + count, threads_.end(),
                                    [id](const Thread& thread) { return thread.id() == id; });
    const bool is_new = known == threads_.end();
    threads_.erase(threads_.begin() + count, known);  // these have ended: threads are listed in order of creation
    if (is_new) threads_.emplace_back(id, entry->path());
    ++count;
  }
  throw_if_too_many_files(ended.value());
  threads_.erase(threads_.begin() + count, threads_.end());
}

std::uint64_t packets_over_loopback() {
  static const File devices("/proc/net/dev");
  char text[4096];
  unsigned long packets = 0;
  if (const char* own = std::strstr(devices.read(text), " lo:")) std::sscanf(own, " lo: %*u %lu", &packets);
  return packets;
}

}  // namespace youbot_base_sim
