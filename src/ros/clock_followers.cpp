#include "youbot_base_sim/ros/clock_followers.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <glob.h>
#include <ros/console.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

namespace youbot_base_sim {

namespace {

constexpr auto kBetweenLooks = std::chrono::microseconds(50);
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

/// Whether a thread sleeps and waits for something; `folder` is its own in /proc.
bool sleeps(const std::string& folder) {
  char text[512];
  const char* state = std::strrchr(read_small(folder + "/stat", text), ')');
  if (state && (state[2] == 'R' || state[2] == 'D')) return false;
  // One that was about to sleep and was preempted on the way has the state of a sleeper, but waits nowhere.
  return std::strcmp(read_small(folder + "/wchan", text), "0") != 0;
}

/// How often the threads of these processes, but the caller, have run so far. With `if_all_sleep`, nullopt if one runs.
std::optional<std::uint64_t> runs_of(const std::set<pid_t>& processes, bool if_all_sleep) {
  const std::string self = std::to_string(syscall(SYS_gettid));
  std::uint64_t runs = 0;
  for (const pid_t process : processes) {
    const std::string folder = "/proc/" + std::to_string(process) + "/task/";
    const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir(folder.c_str()), &closedir);
    if (!threads) continue;  // it has ended
    while (const dirent* entry = readdir(threads.get())) {
      if (entry->d_name[0] == '.' || entry->d_name == self) continue;
      // Read the state first: a thread that runs until then has its time counted when it goes to sleep.
      const std::string thread = folder + entry->d_name;
      if (if_all_sleep && !sleeps(thread)) return std::nullopt;
      // Time on a processor, time of waiting for one, and the number of times: all grow.
      char text[128];
      read_small(thread + "/schedstat", text);
      char* number = text;
      for (int k = 0; k < 3; ++k) runs += std::strtoull(number, &number, 10);
    }
  }
  return runs;
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

/// The port at which, by the master, a node answers; 0 if that is not on this machine.
std::uint32_t port_of(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return 0;
  if (!ros::network::splitURI(uri, host, port)) return 0;
  char name[256] = "";
  gethostname(name, sizeof(name) - 1);
  const std::set<std::string> here = {ros::network::getHost(), name, "localhost", "127.0.0.1"};
  return here.count(host) ? port : 0;
}

}  // namespace

ClockFollowers::ClockFollowers(std::chrono::milliseconds patience)
    : patience_(patience), processes_{{ros::this_node::getName(), {getpid()}}} {}

void ClockFollowers::add(const std::string& node) {
  const std::set<pid_t> processes = holders_of(sockets_at(port_of(node)));
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
  for (;;) {
    const std::string node = restless();
    if (node.empty()) return;
    processes_.erase(node);
    ROS_WARN("%s%s never rests: whether it has read what is published before /clock cannot be known", node.c_str(),
             node == ros::this_node::getName() ? ", this node itself," : "");
  }
}

/// Waits until none of them has run between two looks. If that takes too long, returns the node that had most often.
std::string ClockFollowers::restless() const {
  const auto end = Clock::now() + patience_;
  std::map<std::string, std::uint64_t> before;
  std::map<std::string, int> times;
  // The first look need not read the threads' states, two thirds of the work: at rest, none has run until the second.
  for (bool first = true;; first = false) {
    bool at_rest = !first;
    for (const auto& [node, processes] : processes_) {
      const std::optional<std::uint64_t> runs = runs_of(processes, !first);
      if (runs && std::exchange(before[node], *runs) == *runs) continue;
      at_rest = false;
      ++times[node];
      if (!runs) break;
    }
    if (at_rest) return "";
    if (Clock::now() > end) break;
    std::this_thread::sleep_for(kBetweenLooks);
  }
  return std::max_element(times.begin(), times.end(), [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

}  // namespace youbot_base_sim
