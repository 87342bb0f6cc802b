#include "youbot_base_sim/ros/clock_followers.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <glob.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

namespace youbot_base_sim {

namespace {

constexpr auto kBetweenLooks = std::chrono::microseconds(50);
constexpr auto kBetweenLooksAtStopped = std::chrono::milliseconds(10);
constexpr auto kFirstNotice = std::chrono::seconds(1),
               kNextNotice = std::chrono::seconds(10);  // of one that is stopped
constexpr int kLooks = 1000;                            // to find who is to blame
constexpr char kMaster[] = "the master";
// Polling interval of loops and timers by simulated time: 1 ms, and slack.
constexpr auto kRoscppPolling = std::chrono::microseconds(1200);

/// A small file of /proc; empty if it is gone.
template <std::size_t n>
const char* read_small(const std::string& path, char (&text)[n]) {
  ssize_t size = 0;
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file >= 0) {
    size = read(file, text, n - 1);
    close(file);
  }
  text[size > 0 ? size : 0] = '\0';
  return text;
}

/// The state of a thread, a letter as in /proc; 'X' if it has ended. `folder` is its own in /proc.
char state_of(const std::string& folder) {
  char text[512];
  const char* state = std::strrchr(read_small(folder + "/stat", text), ')');
  return state && state[2] != 'Z' ? state[2] : 'X';
}

/// Whether a signal (T) or a debugger (t) has stopped a thread.
bool is_stopped(const std::string& folder) {
  const char state = state_of(folder);
  return state == 'T' || state == 't';
}

/// Whether a thread has ended, or sleeps and waits for something.
bool sleeps(const std::string& folder) {
  const char state = state_of(folder);
  if (state == 'X') return true;
  if (state != 'S' && state != 'I') return false;
  char text[64];
  // One that was about to sleep and was preempted on the way has the state of a sleeper, but waits nowhere.
  return std::strcmp(read_small(folder + "/wchan", text), "0") != 0;
}

/// Calls `look(folder)` with the folder in /proc of each thread of these processes, but the caller, until it is false.
/// Returns whether it never was.
template <class Look>
bool look_at_threads(const std::set<pid_t>& processes, const Look& look) {
  const std::string self = std::to_string(syscall(SYS_gettid));
  for (const pid_t process : processes) {
    const std::string folder = "/proc/" + std::to_string(process) + "/task/";
    const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir(folder.c_str()), &closedir);
    if (!threads) continue;  // it has ended
    while (const dirent* entry = readdir(threads.get())) {
      if (entry->d_name[0] == '.' || entry->d_name == self) continue;
      if (!look(folder + entry->d_name)) return false;
    }
  }
  return true;
}

bool all_sleep(const std::set<pid_t>& processes) { return look_at_threads(processes, sleeps); }

bool any_is_stopped(const std::set<pid_t>& processes) {
  return !look_at_threads(processes, [](const std::string& thread) { return !is_stopped(thread); });
}

/// How often the threads of these processes, but the caller, have run so far.
std::uint64_t runs_of(const std::set<pid_t>& processes) {
  std::uint64_t runs = 0;
  look_at_threads(processes, [&runs](const std::string& thread) {
    // Time on a processor, time of waiting for one, and the number of times: all grow.
    char text[128];
    read_small(thread + "/schedstat", text);
    char* number = text;
    for (int k = 0; k < 3; ++k) runs += std::strtoull(number, &number, 10);
    return true;
  });
  return runs;
}

/// Time that the threads of a process have run, ns; 0 if it has ended. Takes a microsecond, and so hardly any of the
/// time in which none of them may run.
std::uint64_t processor_time(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(time.tv_nsec);
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

/// The processes that hold one of these sockets, of those that may be looked into: this user's.
std::set<pid_t> holders_of(const std::set<std::string>& sockets) {
  std::set<pid_t> holders;
  glob_t files = {};
  glob("/proc/[0-9]*/fd/*", GLOB_NOSORT, nullptr, &files);
  for (std::size_t k = 0; k < files.gl_pathc; ++k) {
    std::error_code closed;
    if (!sockets.count(std::filesystem::read_symlink(files.gl_pathv[k], closed))) continue;
    holders.insert(std::atoi(files.gl_pathv[k] + std::strlen("/proc/")));
  }
  globfree(&files);
  return holders;
}

/// The processes of this machine that answer at an address; none for another machine's.
std::set<pid_t> processes_at(const std::string& host, std::uint32_t port) {
  char name[256] = "";
  gethostname(name, sizeof(name) - 1);
  const std::set<std::string> here = {ros::network::getHost(), name, "localhost", "127.0.0.1"};
  return here.count(host) ? holders_of(sockets_at(port)) : std::set<pid_t>();
}

/// The processes of a node, by what the master says of it.
std::set<pid_t> processes_of(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return {};
  if (!ros::network::splitURI(uri, host, port)) return {};
  return processes_at(host, port);
}

}  // namespace

ClockFollowers::ClockFollowers(std::chrono::milliseconds patience, const std::atomic<bool>& stop)
    : patience_(patience),
      stop_(stop),
      processes_{{ros::this_node::getName(), {getpid()}},
                 {kMaster, processes_at(ros::master::getHost(), ros::master::getPort())}} {}

void ClockFollowers::add(const std::string& node) {
  const std::set<pid_t> processes = processes_of(node);
  if (!processes.empty()) {
    processes_[node] = processes;
  } else {
    ROS_WARN(
        "%s follows /clock from elsewhere, another machine, container or user: whether it has read what is published "
        "before cannot be known",
        node.c_str());
  }
}

void ClockFollowers::let_clock_arrive() {
  await_rest();
  seen_ = Clock::now() + kRoscppPolling;
}

void ClockFollowers::await_rest() {
  std::this_thread::sleep_until(seen_);
  while (!rest() && goes_on()) give_up_busiest();
}

bool ClockFollowers::goes_on() const { return ros::ok() && !stop_; }

/// Waits until none of them runs, nor has run while that was looked at. Returns whether that has not taken too long,
/// since the last one that was stopped goes on.
bool ClockFollowers::rest() const {
  auto end = Clock::now() + patience_;
  do {
    const std::uint64_t before = work_so_far();
    const auto awake =
        std::find_if_not(processes_.begin(), processes_.end(), [](const auto& one) { return all_sleep(one.second); });
    if (awake == processes_.end() && work_so_far() == before) return true;
    if (awake != processes_.end() && any_is_stopped(awake->second)) {
      await_continuation(awake->first, awake->second);
      end = Clock::now() + patience_;
    }
    std::this_thread::sleep_for(kBetweenLooks);
  } while (Clock::now() < end && goes_on());
  return false;
}

/// Waits while a node is stopped, and names it.
void ClockFollowers::await_continuation(const std::string& node, const std::set<pid_t>& processes) const {
  auto notice = Clock::now() + kFirstNotice;
  for (; any_is_stopped(processes) && goes_on(); std::this_thread::sleep_for(kBetweenLooksAtStopped)) {
    if (Clock::now() < notice) continue;
    ROS_WARN("time waits for %s, which a signal (SIGSTOP) or a debugger has stopped", node.c_str());
    notice += kNextNotice;
  }
}

/// A number that grows whenever a thread of theirs runs, but the caller. Of this process, that takes longer to know.
std::uint64_t ClockFollowers::work_so_far() const {
  std::uint64_t work = 0;
  for (const auto& [node, processes] : processes_) {
    for (const pid_t process : processes) {
      work += process == getpid() ? runs_of({process}) : processor_time(process);
    }
  }
  return work;
}

/// Gives up the one that is seen at work most often. This process and the master also work for others: they are to
/// blame only if no other works half as often. If this process does, it cannot be waited for any longer either.
void ClockFollowers::give_up_busiest() {
  const std::string& self = ros::this_node::getName();
  std::map<std::string, std::uint64_t> before;
  std::map<std::string, int> times;
  for (int look = 0; look < kLooks; ++look) {
    for (const auto& [node, processes] : processes_) {
      const std::uint64_t runs = runs_of(processes);
      if (std::exchange(before[node], runs) == runs && all_sleep(processes)) continue;
      times[node] += node == self || node == kMaster ? 1 : 2;
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
  const std::string busiest = std::max_element(times.begin(), times.end(), [](const auto& a, const auto& b) {
                                return a.second < b.second;
                              })->first;
  const bool keeps_this_busy = times[self] > kLooks / 2;
  ROS_WARN("%s%s has not rested for %g s%s: time no longer waits for it", busiest.c_str(),
           busiest == self ? ", this node itself," : "", std::chrono::duration<double>(patience_).count(),
           busiest != self && keeps_this_busy ? ", and keeps this node busy" : "");
  processes_.erase(busiest);
  if (keeps_this_busy) processes_.erase(self);
}

}  // namespace youbot_base_sim
