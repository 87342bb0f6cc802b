#include "youbot_base_sim/ros/clock_followers.h"

#include <dirent.h>
#include <fcntl.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <ros/xmlrpc_manager.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <set>
#include <thread>

namespace youbot_base_sim {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::seconds(10);  // a busy machine may keep a node from running for a while
constexpr auto kBetweenLooks = std::chrono::microseconds(50);

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

/// How often the threads of a process have run so far; nullopt if one is running. Of this process, all but the caller.
std::optional<std::uint64_t> runs_of(pid_t process) {
  const std::string folder = "/proc/" + std::to_string(process) + "/task/";
  const std::unique_ptr<DIR, int (*)(DIR*)> threads(opendir(folder.c_str()), &closedir);
  const std::string self = std::to_string(syscall(SYS_gettid));
  std::uint64_t runs = 0;
  if (!threads) return runs;  // it has ended
  while (const dirent* entry = readdir(threads.get())) {
    if (entry->d_name[0] == '.' || entry->d_name == self) continue;
    char text[512];
    const char* state = std::strrchr(read_small(folder + entry->d_name + "/stat", text), ')');
    if (state && (state[2] == 'R' || state[2] == 'D')) return std::nullopt;
    // One that was about to sleep and was preempted on the way has the state of a sleeper, but waits nowhere.
    if (std::strcmp(read_small(folder + entry->d_name + "/wchan", text), "0") == 0) return std::nullopt;
    // Time on a processor, time of waiting for one, and the number of times: all grow.
    read_small(folder + entry->d_name + "/schedstat", text);
    char* number = text;
    for (int k = 0; k < 3; ++k) runs += std::strtoull(number, &number, 10);
  }
  return runs;
}

/// The process of a node on this machine; nullopt if it cannot be told.
std::optional<pid_t> process_of(const std::string& node) {
  XmlRpc::XmlRpcValue caller, response, uri;
  caller[0] = ros::this_node::getName();
  XmlRpc::XmlRpcValue request = caller;
  request[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return std::nullopt;
  if (!ros::network::splitURI(uri, host, port)) return std::nullopt;
  char name[256] = "";
  gethostname(name, sizeof(name) - 1);
  const std::set<std::string> here = {ros::network::getHost(), name, "localhost", "127.0.0.1"};
  if (!here.count(host)) return std::nullopt;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  if (!client.execute("getPid", caller, response) || response.getType() != XmlRpc::XmlRpcValue::TypeArray ||
      response.size() < 3 || response[2].getType() != XmlRpc::XmlRpcValue::TypeInt) {
    return std::nullopt;
  }
  return static_cast<int>(response[2]);
}

}  // namespace

void ClockFollowers::add(const std::string& node) {
  if (const auto process = process_of(node)) {
    processes_[node] = *process;
  } else {
    ROS_WARN("%s follows /clock from elsewhere: whether it has read what is published before, nobody can tell",
             node.c_str());
  }
}

void ClockFollowers::await_rest() {
  for (;;) {
    const std::string node = restless();
    if (node.empty()) return;
    processes_.erase(node);
    ROS_WARN("%s never rests: whether it has read what is published before /clock, nobody can tell", node.c_str());
  }
}

/// Waits until none of the processes has run between two looks. Returns the node that has kept it waiting for too long.
std::string ClockFollowers::restless() {
  const auto end = Clock::now() + kPatience;
  std::optional<std::uint64_t> before;
  std::string running;
  for (;;) {
    std::optional<std::uint64_t> now = runs_of(getpid());
    for (auto process = processes_.begin(); now && process != processes_.end(); ++process) {
      const auto runs = runs_of(process->second);
      if (!runs) running = process->first;
      now = runs ? std::optional(*now + *runs) : std::nullopt;
    }
    if (now && now == before) return "";
    before = now;
    if (Clock::now() > end) return running;
    std::this_thread::sleep_for(kBetweenLooks);
  }
}

}  // namespace youbot_base_sim
