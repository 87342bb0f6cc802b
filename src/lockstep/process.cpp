#include "youbot_base_sim/lockstep/process.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <glob.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>

namespace youbot_base_sim {

namespace {

void throw_if_too_many_files(const std::string& path) {
  if (errno == EMFILE || errno == ENFILE) throw std::system_error(errno, std::generic_category(), path);
}

/// A small file of /proc, read again and again: it stays open, for opening it takes four times as long as reading.
class File {
 public:
  explicit File(std::string path) : path_(std::move(path)) {
    if (kept < kMaxKept) file_ = open_file();
    if (file_ >= 0) ++kept;
  }
  File(File&& other) noexcept : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(file_, other.file_);
    return *this;
  }
  ~File() {
    if (file_ < 0) return;
    close(file_);
    --kept;
  }

  /// The text; empty if what it is about has ended. Throws std::system_error where this process has too many files.
  template <std::size_t n>
  const char* read(char (&text)[n]) const {
    const int file = file_ >= 0 ? file_ : open_file();
    const ssize_t size = file >= 0 ? pread(file, text, n - 1, 0) : 0;
    if (file >= 0 && file != file_) close(file);
    text[size > 0 ? size : 0] = '\0';
    return text;
  }

 private:
  static constexpr int kMaxKept = 500;  // of about 1000 that a process may have
  static std::atomic<int> kept;

  int open_file() const {
    const int file = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) throw_if_too_many_files(path_);
    return file;
  }

  std::string path_;
  int file_ = -1;
};

std::atomic<int> File::kept{0};

/// Processor time of a process, ns; 0 if it has ended. It lacks what its threads that run just now have run since they
/// began. Takes a microsecond, and so hardly any of the time in which none of them may run.
std::uint64_t processor_time(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(time.tv_nsec);
}

/// True where wchan is "0" from the moment a thread is woken, not only once the thread can run: since Linux 5.16.
bool wchan_shows_waking() {
  utsname system{};
  int version = 0, patchlevel = 0;
  uname(&system);
  std::sscanf(system.release, "%d.%d", &version, &patchlevel);
  return version > 5 || (version == 5 && patchlevel >= 16);
}

/// The sockets that listen at a TCP port of this machine, as /proc names them.
std::set<std::string> sockets_at(std::uint32_t port) {
  constexpr unsigned kListening = 0x0A;
  std::set<std::string> sockets;
  for (const char* path : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream table(path);
    for (std::string line; std::getline(table, line);) {
      unsigned local = 0, state = 0;
      unsigned long inode = 0;
      std::sscanf(line.c_str(), "%*s %*[^:]:%x %*s %x %*s %*s %*s %*s %*s %lu", &local, &state, &inode);
      if (state == kListening && local == port) sockets.insert(fmt::format("socket:[{}]", inode));
    }
  }
  return sockets;
}

}  // namespace

class Process::Thread {
 public:
  /// `folder`: its own in /proc.
  Thread(pid_t id, const std::string& folder)
      : id_(id), stat_(folder + "/stat"), wchan_(folder + "/wchan"), schedstat_(folder + "/schedstat") {}

  pid_t id() const { return id_; }

  /// True once it is found to have ended. Another thread may have its number since.
  bool is_gone() const { return gone_; }

  bool is_stopped() const {
    const char now = state();
    return now == 'T' || now == 't';  // by a signal, by a debugger
  }

  /// True if it waits for something or has ended. One that has not run since it was seen to wait can only have been
  /// woken, and then it waits nowhere.
  bool sleeps() {
    static const bool kShowsWaking = wchan_shows_waking();
    char now_seen[sizeof seen_] = "", place[64];
    schedstat_.read(now_seen);
    if (!kShowsWaking || !is_counted() || std::strcmp(now_seen, seen_) != 0) {
      seen_[0] = '\0';
      const char now = state();
      gone_ = now == kGone;
      if (now == 'Z' || now == 'X') return true;
      if (now != 'S' && now != 'I') return false;
    }
    // One that was about to sleep and was preempted on the way has the state of a sleeper, but waits nowhere.
    if (std::strcmp(wchan_.read(place), "0") == 0) return false;
    std::copy(std::begin(now_seen), std::end(now_seen), seen_);
    return true;
  }

  /// Grows whenever it runs: time on a processor, time waiting for one, and how often it got one.
  std::uint64_t work_so_far() const {
    const Schedule schedule = scheduled();
    return schedule.on_processor + schedule.waiting + schedule.runs;
  }

  void mark() {
    const std::uint64_t runs = scheduled().runs;
    if (runs != marked_) classify_wait();
    marked_ = runs;
    polls_ = waits_for_time_ && poll_score_ >= kPollScore;
  }

  void learn_polls(std::chrono::nanoseconds since) {
    const bool has_polled = (scheduled().runs - marked_) * kBetweenPolls >= since;
    poll_score_ = has_polled ? std::min(poll_score_ + 1, kMaxPollScore) : std::max(poll_score_ - 1, 0);
  }

  bool has_late_poll() const { return polls_ && scheduled().runs == marked_; }

 private:
  struct Schedule {
    std::uint64_t on_processor = 0, waiting = 0, runs = 0;  // ns, ns, number of times; 0 if it has ended
  };

  static constexpr auto kBetweenPolls = std::chrono::microseconds(2500);  // at most; most sleep for a millisecond
  static constexpr int kPollScore = 2, kMaxPollScore = 5;                 // of poll_score_
  static constexpr char kGone = '\0';

  /// A letter as in /proc.
  char state() const {
    char text[512];
    const char* state = std::strrchr(stat_.read(text), ')');
    return state ? state[2] : kGone;
  }

  Schedule scheduled() const {
    char text[128];
    schedstat_.read(text);
    Schedule schedule;
    char* number = text;
    for (std::uint64_t* field : {&schedule.on_processor, &schedule.waiting, &schedule.runs})
      *field = std::strtoull(number, &number, 10);
    return schedule;
  }

  /// Some kernels do not count.
  bool is_counted() const { return seen_[0] != '\0' && std::strncmp(seen_, "0 0 0", 5) != 0; }

  /// Polls wait in a sleep of their own or at a condition. One that begins to sleep may be about to poll.
  void classify_wait() {
    char place[64];
    wchan_.read(place);
    if (std::strcmp(place, "0") == 0) return;  // it runs
    const bool naps = std::strstr(place, "nanosleep") != nullptr;
    waits_for_time_ = naps || std::strstr(place, "futex") != nullptr;
    if (naps != naps_) poll_score_ = naps ? kPollScore : 0;
    naps_ = naps;
  }

  pid_t id_;
  File stat_, wchan_, schedstat_;
  char seen_[128] = "";  // of schedstat, when it was last seen to wait
  bool gone_ = false;
  std::uint64_t marked_ = 0;  // runs at the mark
  bool naps_ = false, waits_for_time_ = true, polls_ = false;
  int poll_score_ = kPollScore;  // marks after which it has polled, less those after which it has not
};

Process::Process(pid_t id) : id_(id), folder_(opendir(fmt::format("/proc/{}/task", id).c_str()), &closedir) {
  if (!folder_) throw_if_too_many_files(fmt::format("/proc/{}/task", id));
}
Process::Process(Process&&) noexcept = default;
Process& Process::operator=(Process&&) noexcept = default;
Process::~Process() = default;

bool Process::sleeps() {
  find_threads();
  return std::all_of(threads_.begin(), threads_.end(), std::mem_fn(&Thread::sleeps));
}

bool Process::is_stopped() {
  find_threads();
  return std::any_of(threads_.begin(), threads_.end(), std::mem_fn(&Thread::is_stopped));
}

std::uint64_t Process::work_so_far() {
  if (id_ != getpid()) return processor_time(id_);
  find_threads();
  std::uint64_t work = 0;
  for (const Thread& thread : threads_) work += thread.work_so_far();
  return work;
}

void Process::mark() {
  find_threads();
  for (Thread& thread : threads_) thread.mark();
}

void Process::learn_polls(std::chrono::nanoseconds since) {
  for (Thread& thread : threads_) thread.learn_polls(since);
}

bool Process::has_late_poll() const {
  return std::any_of(threads_.begin(), threads_.end(), std::mem_fn(&Thread::has_late_poll));
}

void Process::find_threads() {
  if (!folder_) return;  // it had ended before
  rewinddir(folder_.get());
  std::ptrdiff_t count = 0;
  while (const dirent* entry = readdir(folder_.get())) {
    const pid_t id = std::atoi(entry->d_name);
    if (id == 0 || id == gettid()) continue;  // 0: "." and ".."
    const auto known = std::find_if(threads_.begin() + count, threads_.end(),
                                    [id](const Thread& thread) { return thread.id() == id && !thread.is_gone(); });
    const bool is_new = known == threads_.end();
    threads_.erase(threads_.begin() + count, known);  // these have ended: threads are listed in order of creation
    if (is_new) threads_.emplace_back(id, fmt::format("/proc/{}/task/{}", id_, id));
    ++count;
  }
  threads_.erase(threads_.begin() + count, threads_.end());
}

std::vector<Process> processes_listening_at(std::uint32_t port) {
  const std::set<std::string> sockets = sockets_at(port);
  std::set<pid_t> holders;
  glob_t files = {};
  glob("/proc/[0-9]*/fd/*", GLOB_NOSORT, nullptr, &files);
  for (std::size_t k = 0; k < files.gl_pathc; ++k) {
    std::error_code closed;
    if (!sockets.count(std::filesystem::read_symlink(files.gl_pathv[k], closed))) continue;
    holders.insert(std::atoi(files.gl_pathv[k] + std::strlen("/proc/")));
  }
  globfree(&files);
  return {holders.begin(), holders.end()};
}

}  // namespace youbot_base_sim
