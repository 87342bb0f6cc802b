#include "youbot_base_sim/lockstep/process.h"

#include <fmt/format.h>
#include <glob.h>
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
#include <fstream>
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

  /// True if it waits for something or has ended. One that has not run since it was seen to wait can only have been
  /// woken, and then it waits nowhere. So does one that was preempted on its way to sleep, whatever its state.
  bool sleeps(bool process_has_run) {
    static const bool kShowsWaking = wchan_shows_waking();
    const bool waits = place() != "0";
    const std::uint64_t work = process_has_run ? work_so_far() : work_at_rest_;
    if (waits && work == work_at_rest_ && kShowsWaking) return true;
    const char now = state();
    if (waits && (now == 'S' || now == 'I')) work_at_rest_ = work;
    return now == 'Z' || now == 'X' || (waits && (now == 'S' || now == 'I'));
  }

  /// Grows whenever it runs: time on a processor, time waiting for one, and how often it got one.
  std::uint64_t work_so_far() const {
    const auto [on_processor, waiting, runs] = scheduled();
    return on_processor + waiting + runs;
  }

  /// Polls wait in a sleep of their own or at a condition. One that begins to sleep may be about to poll.
  void mark() {
    const std::string waits_at = place();
    const std::uint64_t runs = scheduled()[2];
    if (std::exchange(marked_, runs) != runs && waits_at != "0") {
      const bool naps = waits_at.find("nanosleep") != std::string::npos;
      waits_for_time_ = naps || waits_at.find("futex") != std::string::npos;
      if (std::exchange(naps_, naps) != naps) poll_score_ = naps ? kPollScore : 0;
    }
    polls_ = waits_for_time_ && poll_score_ >= kPollScore;
  }

  void learn_polls(std::chrono::nanoseconds since) {
    const bool has_polled = (scheduled()[2] - marked_) * kBetweenPolls >= since;
    poll_score_ = std::clamp(poll_score_ + (has_polled ? 1 : -1), 0, kMaxPollScore);
  }

  bool has_late_poll() const { return polls_ && scheduled()[2] == marked_; }

 private:
  // At most; most sleep for one, but on a busy machine their turn comes late.
  static constexpr auto kBetweenPolls = std::chrono::milliseconds(10);
  static constexpr int kPollScore = 2, kMaxPollScore = 5;  // of poll_score_

  /// Nanoseconds on a processor and waiting for one, and number of runs; 0 if it has ended.
  std::array<std::uint64_t, 3> scheduled() const {
    char text[128];
    std::array<std::uint64_t, 3> fields{};
    char* number = schedstat_.read(text);
    for (std::uint64_t& field : fields) field = std::strtoull(number, &number, 10);
    return fields;
  }

  /// Where in the kernel it waits; "0": nowhere.
  std::string place() const {
    char text[64];
    return wchan_.read(text);
  }

  pid_t id_;
  std::string folder_;
  File wchan_, schedstat_;
  std::uint64_t work_at_rest_ = 0;  // when it was last seen to wait
  std::uint64_t marked_ = 0;        // runs at the mark
  bool naps_ = false, waits_for_time_ = true, polls_ = false;
  int poll_score_ = kPollScore;  // marks after which it has polled, less those after which it has not
};

Process::Process(pid_t id) : id_(id) {}
Process::Process(Process&&) noexcept = default;
Process& Process::operator=(Process&&) noexcept = default;
Process::~Process() = default;

bool Process::rests() {
  const std::uint64_t work = work_so_far();
  const bool has_run = work != work_at_rest_ || threads_.empty();
  work_at_rest_ = 0;
  if (has_run) find_threads();
  for (Thread& thread : threads_) {
    if (!thread.sleeps(has_run)) return false;
  }
  if (work_so_far() != work) return false;
  work_at_rest_ = work;
  return true;
}

bool Process::is_stopped() const {
  const char state = threads_.empty() ? 'X' : threads_.front().state();
  return state == 'T' || state == 't';  // by a signal, by a debugger
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
  namespace fs = std::filesystem;
  std::error_code ended;
  std::ptrdiff_t count = 0;
  for (fs::directory_iterator entry(fmt::format("/proc/{}/task", id_), ended), last; entry != last;
       entry.increment(ended)) {
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

std::vector<Process> processes_listening_at(std::uint32_t port) {
  constexpr unsigned kListening = 0x0A;
  std::set<std::string> sockets;  // as /proc names them
  for (const char* path : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream table(path);
    for (std::string line; std::getline(table, line);) {
      unsigned local = 0, state = 0;
      unsigned long inode = 0;
      std::sscanf(line.c_str(), "%*s %*[^:]:%x %*s %x %*s %*s %*s %*s %*s %lu", &local, &state, &inode);
      if (state == kListening && local == port) sockets.insert(fmt::format("socket:[{}]", inode));
    }
  }
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

std::uint64_t packets_over_loopback() {
  static const File devices("/proc/net/dev");
  char text[4096];
  unsigned long packets = 0;
  if (const char* own = std::strstr(devices.read(text), " lo:")) std::sscanf(own, " lo: %*u %lu", &packets);
  return packets;
}

}  // namespace youbot_base_sim
