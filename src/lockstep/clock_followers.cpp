#include "youbot_base_sim/lockstep/clock_followers.h"

#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <set>
#include <thread>
#include <utility>

namespace youbot_base_sim {

namespace {

constexpr auto kBetweenLooks = std::chrono::microseconds(50);
constexpr auto kBetweenLooksAtStopped = std::chrono::milliseconds(10);
constexpr auto kFirstNotice = std::chrono::seconds(1),
               kNextNotice = std::chrono::seconds(10);  // of one that is stopped
constexpr int kLooks = 1000;                            // that find the busiest node
constexpr char kMaster[] = "the master";
// Loops and timers look at simulated time once a millisecond; and slack. On virtual machines 1 of 100 such sleeps takes
// longer, up to 5 ms.
constexpr auto kRoscppPolling = std::chrono::microseconds(1200);
constexpr auto kLatePoll = std::chrono::milliseconds(10);  // one that is later is not waited for

/// The bytes of an IP address, 4 or 16; none for an address of another kind.
std::string bytes_of(const sockaddr* address) {
  if (!address) return "";
  const char* bytes = reinterpret_cast<const char*>(address);
  if (address->sa_family == AF_INET) return {bytes + offsetof(sockaddr_in, sin_addr), sizeof(in_addr)};
  if (address->sa_family == AF_INET6) return {bytes + offsetof(sockaddr_in6, sin6_addr), sizeof(in6_addr)};
  return "";
}

/// True for a name or address of an interface of this machine, any of 127.0.0.0/8, and the name that this node gives
/// itself, though it may not resolve.
bool is_here(const std::string& host) {
  if (host == ros::network::getHost()) return true;
  constexpr char kLoopback = 127;
  std::set<std::string> own;
  ifaddrs* interfaces = nullptr;
  getifaddrs(&interfaces);
  for (const ifaddrs* one = interfaces; one; one = one->ifa_next) own.insert(bytes_of(one->ifa_addr));
  freeifaddrs(interfaces);
  addrinfo* addresses = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, nullptr, &addresses) != 0) return false;
  bool found = false;
  for (const addrinfo* one = addresses; one; one = one->ai_next) {
    const std::string bytes = bytes_of(one->ai_addr);
    found = found || (bytes.size() == sizeof(in_addr) && bytes.front() == kLoopback) || own.count(bytes) > 0;
  }
  freeaddrinfo(addresses);
  return found;
}

/// The processes of this machine that answer at an address; none for another machine's.
std::vector<Process> processes_at(const std::string& host, std::uint32_t port) {
  return is_here(host) ? processes_listening_at(port) : std::vector<Process>();
}

/// The processes of a node, by what the master says of it.
std::vector<Process> processes_of(const std::string& node) {
  XmlRpc::XmlRpcValue request, response, uri;
  request[0] = ros::this_node::getName();
  request[1] = node;
  std::string host;
  std::uint32_t port = 0;
  if (!ros::master::execute("lookupNode", request, response, uri, false)) return {};
  if (!ros::network::splitURI(uri, host, port)) return {};
  return processes_at(host, port);
}

bool all_sleep(std::vector<Process>& processes) {
  return std::all_of(processes.begin(), processes.end(), [](Process& process) { return process.sleeps(); });
}

bool any_is_stopped(std::vector<Process>& processes) {
  return std::any_of(processes.begin(), processes.end(), [](Process& process) { return process.is_stopped(); });
}

std::uint64_t work_of(std::vector<Process>& processes) {
  std::uint64_t work = 0;
  for (Process& process : processes) work += process.work_so_far();
  return work;
}

}  // namespace

ClockFollowers::ClockFollowers(Publish publish, std::chrono::milliseconds patience, const std::atomic<bool>& stop)
    : publish_(std::move(publish)), patience_(patience), stop_(stop) {
  processes_[ros::this_node::getName()].emplace_back(getpid());
  processes_[kMaster] = processes_at(ros::master::getHost(), ros::master::getPort());
}

void ClockFollowers::add(const std::string& node) {
  std::vector<Process> processes = processes_of(node);
  if (!processes.empty()) {
    processes_[node] = std::move(processes);
  } else {
    ROS_WARN(
        "%s follows /clock from elsewhere, another machine, container or user: whether it has read what is published "
        "before cannot be known",
        node.c_str());
  }
}

void ClockFollowers::announce(const ros::Time& time) {
  await_rest();
  publish_(time);
  await_rest();
  for (auto& [node, processes] : processes_) {
    for (Process& process : processes) process.mark();
  }
  arrived_ = Clock::now();
}

void ClockFollowers::await_rest() {
  if (arrived_) await_polls(*std::exchange(arrived_, std::nullopt));
  while (!rest() && goes_on()) drop_busiest();
}

bool ClockFollowers::goes_on() const { return ros::ok() && !stop_; }

/// Waits until all threads that are known to poll simulated time have run since /clock arrived, or are too late.
void ClockFollowers::await_polls(Clock::time_point arrived) {
  std::this_thread::sleep_until(arrived + kRoscppPolling);
  const auto is_late = [](const auto& one) {
    return std::any_of(one.second.begin(), one.second.end(), std::mem_fn(&Process::has_late_poll));
  };
  while (std::any_of(processes_.begin(), processes_.end(), is_late) && Clock::now() < arrived + kLatePoll && goes_on())
    std::this_thread::sleep_for(kBetweenLooks);
  const auto since = Clock::now() - arrived;
  for (auto& [node, processes] : processes_) {
    for (Process& process : processes) process.learn_polls(since);
  }
}

/// Waits until none of them runs, nor has run while that was looked at. Returns whether that has not taken too long,
/// without the time that one was stopped.
bool ClockFollowers::rest() {
  auto end = Clock::now() + patience_;
  do {
    const std::uint64_t before = work_so_far();
    const auto awake =
        std::find_if_not(processes_.begin(), processes_.end(), [](auto& one) { return all_sleep(one.second); });
    if (awake == processes_.end() && work_so_far() == before) return true;
    if (awake != processes_.end() && any_is_stopped(awake->second)) {
      const auto start = Clock::now();
      await_continuation(awake->first, awake->second);
      end += Clock::now() - start;
    }
    std::this_thread::sleep_for(kBetweenLooks);
  } while (Clock::now() < end && goes_on());
  return false;
}

/// Waits while a node is stopped, and names it.
void ClockFollowers::await_continuation(const std::string& node, std::vector<Process>& processes) const {
  auto notice = Clock::now() + kFirstNotice;
  for (; any_is_stopped(processes) && goes_on(); std::this_thread::sleep_for(kBetweenLooksAtStopped)) {
    if (Clock::now() < notice) continue;
    ROS_WARN("time waits for %s, which a signal (SIGSTOP) or a debugger has stopped", node.c_str());
    notice += kNextNotice;
  }
}

std::uint64_t ClockFollowers::work_so_far() {
  std::uint64_t work = 0;
  for (auto& [node, processes] : processes_) work += work_of(processes);
  return work;
}

/// Gives up the node that most looks find at work, unless one is stopped that may keep the others waiting. This process
/// and the master also work for others, so their looks count half. The gate also gives up this process where it works
/// in half of all looks.
void ClockFollowers::drop_busiest() {
  for (auto& [node, processes] : processes_) {
    if (any_is_stopped(processes)) return await_continuation(node, processes);
  }
  const std::string& self = ros::this_node::getName();
  std::map<std::string, std::uint64_t> before;
  std::map<std::string, int> times;
  for (int look = 0; look < kLooks; ++look) {
    for (auto& [node, processes] : processes_) {
      const std::uint64_t work = work_of(processes);
      if (std::exchange(before[node], work) == work && all_sleep(processes)) continue;
      times[node] += node == self || node == kMaster ? 1 : 2;
    }
    std::this_thread::sleep_for(kBetweenLooks);
  }
  if (times.empty()) return;  // it has ended
  const std::string busiest = std::max_element(times.begin(), times.end(), [](const auto& a, const auto& b) {
                                return a.second < b.second;
                              })->first;
  const bool keeps_this_busy = times[self] > kLooks / 2;
  ROS_WARN("%s%s has not rested for %g s%s: time no longer waits for it", busiest.c_str(),
           busiest == self ? ", this node itself," : "", std::chrono::duration<double>(patience_).count(),
           busiest != self && keeps_this_busy ? ", and keeps this node busy" : "");
  const auto give_up = [this](const std::string& node) {
    processes_.erase(node);
    given_up_.insert(node);
  };
  give_up(busiest);
  if (keeps_this_busy) give_up(self);
}

}  // namespace youbot_base_sim
