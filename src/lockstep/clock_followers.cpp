#include "youbot_base_sim/lockstep/clock_followers.h"

#include <fmt/format.h>
#include <glob.h>
#include <netdb.h>
#include <ros/console.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <ros/xmlrpc_manager.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <thread>
#include <utility>

namespace youbot_base_sim {

namespace {

constexpr auto kBetweenLooks = std::chrono::microseconds(50);
constexpr int kLooksAtAll = 20;  // and not only at the one that is waited for: one in so many
constexpr auto kFirstNotice = std::chrono::seconds(1),
               kNextNotice = std::chrono::seconds(10);  // of one that is stopped
constexpr int kRestsToReturn = 10;                      // steps with a rest, for one that was given up
constexpr std::size_t kManyThreads = 100;               // of one node, which a warning names
constexpr char kMaster[] = "the master";
constexpr unsigned kConnected = 0x01, kListening = 0x0A;  // states of sockets
// Loops and timers look at simulated time once a millisecond; and slack. On virtual machines 1 of 100 such sleeps takes
// longer, up to 5 ms.
constexpr auto kRoscppPolling = std::chrono::microseconds(1200);
constexpr auto kLatePoll = std::chrono::milliseconds(10);      // one that is later is not waited for
constexpr int kStepsToLearn = 10;                              // one in so many waits though no node is known to poll
constexpr auto kBetweenLinks = std::chrono::milliseconds(50);  // looks for links that are not there yet
constexpr auto kLinking = std::chrono::seconds(10);            // for a link at most
constexpr auto kSettling = std::chrono::seconds(1);            // after news of the master: it is asked at each rest

using Names = std::set<std::string>;

/// True for a name or address of this machine, to which a socket can be bound, and the name that this node gives
/// itself, though it may not resolve.
bool is_here(const std::string& host) {
  if (host == ros::network::getHost()) return true;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, nullptr, &found) != 0) return false;
  const int probe = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool is_bound = bind(probe, found->ai_addr, found->ai_addrlen) == 0;
  close(probe);
  freeaddrinfo(found);
  return is_bound;
}

struct Socket {
  unsigned state = 0, local = 0, remote = 0;  // local and remote port
  pid_t holder = 0;
};

/// The TCP sockets of this machine's processes; of those that may be looked into: this user's.
std::vector<Socket> tcp_sockets() {
  std::map<std::string, Socket> known;  // as /proc names them
  for (const char* path : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream table(path);
    for (std::string line; std::getline(table, line);) {
      Socket socket;
      unsigned long inode = 0;
      std::sscanf(line.c_str(), "%*s %*[^:]:%x %*[^:]:%x %x %*s %*s %*s %*s %*s %lu", &socket.local, &socket.remote,
                  &socket.state, &inode);
      known[fmt::format("socket:[{}]", inode)] = socket;
    }
  }
  std::vector<Socket> sockets;
  glob_t files = {};
  glob("/proc/[0-9]*/fd/*", GLOB_NOSORT, nullptr, &files);
  for (std::size_t k = 0; k < files.gl_pathc; ++k) {
    std::error_code closed;
    const auto socket = known.find(std::filesystem::read_symlink(files.gl_pathv[k], closed));
    if (socket == known.end()) continue;
    sockets.push_back(socket->second);
    sockets.back().holder = std::atoi(files.gl_pathv[k] + std::strlen("/proc/"));
  }
  globfree(&files);
  return sockets;
}

/// The other processes of this machine that answer at an address. This one may hold the socket of one that started it.
std::vector<Process> processes_at(const std::string& host, unsigned port) {
  std::set<pid_t> found;
  if (is_here(host)) {
    for (const Socket& socket : tcp_sockets())
      if (socket.state == kListening && socket.local == port) found.insert(socket.holder);
    found.erase(getpid());
  }
  return {found.begin(), found.end()};
}

/// The master's answer; nothing if it fails.
XmlRpc::XmlRpcValue ask_master(const char* method, const std::string& argument = "") {
  XmlRpc::XmlRpcValue request, response, answer;
  request[0] = ros::this_node::getName();
  if (!argument.empty()) request[1] = argument;
  ros::master::execute(method, request, response, answer, false);
  return answer;
}

/// By topic, what the master's state says of its publishers (0) or subscribers (1).
std::map<std::string, Names> nodes_by_topic(XmlRpc::XmlRpcValue& state, int role) {
  std::map<std::string, Names> nodes;
  for (int k = 0; state.valid() && k < state[role].size(); ++k) {
    for (int i = 0; i < state[role][k][1].size(); ++i) nodes[state[role][k][0]].insert(state[role][k][1][i]);
  }
  return nodes;
}

/// The nodes that hear each node, by what the master knows; all have /clock and the log in common.
std::map<std::string, Names> listeners_by_node(XmlRpc::XmlRpcValue& state) {
  std::map<std::string, Names> listeners;
  auto subscribers = nodes_by_topic(state, 1);
  for (const auto& [topic, publishers] : nodes_by_topic(state, 0)) {
    if (topic == "/clock" || topic == "/rosout") continue;
    for (const std::string& name : publishers)
      listeners[name].insert(subscribers[topic].begin(), subscribers[topic].end());
  }
  return listeners;
}

/// Inserts the node and all that its messages reach within a step; this node answers with the next one.
void insert_reached(const std::string& node, std::map<std::string, Names>& listeners, Names& reached) {
  if (!reached.insert(node).second || node == ros::this_node::getName()) return;
  for (const std::string& listener : listeners[node]) insert_reached(listener, listeners, reached);
}

/// Lets no other thread of this process preempt one when it wakes it. roscpp's, which sends, would use up its time
/// while the thread that has woken it to send holds it up.
void defer_other_threads() {
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    const sched_param none{};
    const pid_t id = std::atoi(thread.path().filename().c_str());
    if (id != gettid()) sched_setscheduler(id, SCHED_BATCH, &none);
  }
}

std::uint64_t work_of(std::vector<Process>& processes) {
  std::uint64_t work = 0;
  for (Process& process : processes) work += process.work_so_far();
  return work;
}

}  // namespace

ClockFollowers::ClockFollowers(ros::NodeHandle& node, std::chrono::duration<double> patience,
                               const std::atomic<bool>& stop)
    : links_(node), patience_(std::chrono::duration_cast<Clock::duration>(patience)), stop_(stop) {
  rlimit files{};  // two for each thread
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  defer_other_threads();
  nodes_[ros::this_node::getName()].port = ros::XMLRPCManager::instance()->getServerPort();
  nodes_[ros::this_node::getName()].processes.emplace_back(getpid());
  nodes_[kMaster].processes = processes_at(ros::master::getHost(), ros::master::getPort());
}

ClockFollowers::Node ClockFollowers::look_up(const std::string& name) {
  Node node;
  std::string host, uri = ask_master("lookupNode", name);
  if (ros::network::splitURI(uri, host, node.port)) node.processes = processes_at(host, node.port);
  return node;
}

void ClockFollowers::add(const std::string& name) {
  master_work_.reset();
  const Node& node = nodes_[name] = look_up(name);
  if (!node.processes.empty() || !ask_master("lookupNode", name).valid()) return;  // or it has gone
  ROS_WARN(
      "%s follows /clock from elsewhere, another machine, container or user: whether it has read what is published "
      "before cannot be known",
      name.c_str());
}

void ClockFollowers::update_nodes() {
  for (const auto& [name, comes] : links_.take_changes()) {
    if (name == ros::this_node::getName()) continue;  // always there
    master_work_.reset();
    nodes_.erase(name);
    if (comes) add(name);
  }
}

void ClockFollowers::announce(const ros::Time& time) {
  if (!links_.set_time(time)) return;  // before nodes are listed: one that comes afterwards receives it so
  if (++steps_ % kStepsToLearn == 0) warn_of_threads();
  take_back();
  await_rest();
  for (const Group& group : groups_) {
    for (const std::string& name : group) links_.send(name);
    await_sleep();
    await_polls(group);
    await_sleep();
  }
}

/// Puts each node into the first group after all that have a node before it by name with which it interacts.
void ClockFollowers::order_groups() {
  std::map<std::string, Names> listeners = listeners_by_node(state_);
  groups_ = {{ros::this_node::getName()}};
  std::vector<Names> reached(1);  // by each group
  for (const auto& [name, node] : nodes_) {
    if (name == kMaster || name == groups_[0][0]) continue;
    Names own;
    insert_reached(name, listeners, own);
    std::size_t level = groups_.size();
    const auto is_free = [&](const std::string& one) { return reached[level - 1].count(one) == 0; };
    while (level > 0 && std::all_of(own.begin(), own.end(), is_free)) --level;
    groups_.resize(std::max(groups_.size(), level + 1));
    reached.resize(groups_.size());
    groups_[level].push_back(name);
    reached[level].insert(own.begin(), own.end());
  }
}

/// Waits until all threads of the group that are known to poll simulated time have run since /clock arrived, or are too
/// late.
void ClockFollowers::await_polls(const Group& group) {
  const bool learns = steps_ % kStepsToLearn == 0;
  std::vector<Process*> processes;
  for (const std::string& name : group) {
    const auto node = nodes_.find(name);
    if (node == nodes_.end()) continue;  // has ended
    for (Process& process : node->second.processes) {
      if (!process.mark(learns) && !learns) continue;
      node->second.may_have_polled = true;
      processes.push_back(&process);
    }
  }
  if (processes.empty()) return;
  const auto arrived = Clock::now();
  std::this_thread::sleep_until(arrived + kRoscppPolling);
  while (std::any_of(processes.begin(), processes.end(), std::mem_fn(&Process::has_late_poll)) &&
         Clock::now() < arrived + kLatePoll && goes_on())
    std::this_thread::sleep_for(kBetweenLooks);
  for (Process* process : processes) process->learn_polls(Clock::now() - arrived);
}

/// Where the master has worked since the last rest, waits for what follows from that, until it knows nothing new. What
/// comes between its answer and the look at its work is noticed by the next question.
bool ClockFollowers::await_rest() {
  await_sleep();
  if (work_of(nodes_[kMaster].processes) == master_work_ && Clock::now() > settled_) return true;
  const XmlRpc::XmlRpcValue state = ask_master("getSystemState");
  if (!master_work_ || state != state_) {
    state_ = state;
    master_work_ = 0;  // until a node comes or goes
    await_links();
    order_groups();
    settled_ = Clock::now() + kSettling;
    return await_rest();
  }
  await_sleep();
  if (master_work_) master_work_ = work_of(nodes_[kMaster].processes);  // no node has come or gone meanwhile
  return true;
}

/// Waits for the links of new subscriptions: meanwhile all may sleep, rosmaster for 0.1 s before it informs a
/// subscriber, roscpp up to 0.4 s before it connects.
void ClockFollowers::await_links() {
  std::string missing = missing_link();
  for (const auto end = Clock::now() + kLinking; !missing.empty() && Clock::now() < end && goes_on();) {
    std::this_thread::sleep_for(kBetweenLinks);
    await_sleep();
    missing = missing_link();
  }
  if (!missing.empty() && goes_on()) ROS_WARN("time no longer waits for a link between %s", missing.c_str());
  await_sleep();
}

/// A node that the master knows to follow /clock and that is not linked, or two between whose processes there are fewer
/// connections, XML-RPC aside, than topics by which one hears the other; as text, empty: there are none.
std::string ClockFollowers::missing_link() {
  std::set<unsigned> xmlrpc;
  std::map<pid_t, Names> names;  // several of one that holds the sockets of what started it too
  for (const auto& [name, node] : nodes_) {
    xmlrpc.insert(node.port);
    for (const Process& process : node.processes) names[process.id()].insert(name);
  }
  std::map<std::pair<unsigned, unsigned>, Names> ends;  // of connections, by ports: its own, the other's
  for (const Socket& socket : tcp_sockets()) {
    if (socket.state != kConnected || xmlrpc.count(socket.local) + xmlrpc.count(socket.remote) > 0) continue;
    ends[{socket.local, socket.remote}].merge(Names(names[socket.holder]));
  }
  std::map<std::pair<std::string, std::string>, int> links;
  for (const auto& [ports, here] : ends)
    for (const std::string& name : here)
      for (const std::string& other : ends[{ports.second, ports.first}]) ++links[{name, other}];
  auto publishers = nodes_by_topic(state_, 0);
  for (const auto& [topic, subscribers] : nodes_by_topic(state_, 1)) {
    for (const std::string& to : subscribers) {
      const auto listener = nodes_.find(to);
      if (listener == nodes_.end() && topic == "/clock" && !look_up(to).processes.empty()) return "/clock and " + to;
      if (listener == nodes_.end() || listener->second.processes.empty()) continue;
      for (const std::string& from : publishers[topic]) {
        const auto speaker = nodes_.find(from);
        if (speaker == listener || speaker == nodes_.end() || speaker->second.processes.empty()) continue;
        if (--links[std::minmax(from, to)] < 0) return fmt::format("{} and {}", from, to);
      }
    }
  }
  return "";
}

/// Waits until each node has been at rest since the last packet between them, or all have been with no work in between.
/// Without a packet since the last rest only loops and timers may have woken, and nodelets in this process.
void ClockFollowers::await_sleep() {
  update_nodes();
  std::map<std::string, int> awake;  // looks that have found it at work; half of them if it also works for others
  std::vector<std::pair<const std::string, Node>*> pending;
  std::uint64_t packets = 0, work = 0;
  auto end = Clock::now() + patience_, notice = Clock::now() + kFirstNotice;
  for (int looks = 1; goes_on(); ++looks, std::this_thread::sleep_for(kBetweenLooks)) {
    if (pending.empty()) {
      packets = packets_over_loopback();
      const bool is_quiet = packets == packets_at_rest_;
      work = is_quiet ? 0 : work_so_far();
      for (auto& one : nodes_) {
        const bool is_own = one.first == ros::this_node::getName();  // looked at first: it sends what others wake for
        if (one.second.rests_to_return > 0 || (is_quiet && !is_own && !one.second.may_have_polled)) continue;
        pending.insert(is_own ? pending.end() : pending.begin(), &one);
      }
    }
    while (!pending.empty() && rests(pending.back()->second)) pending.pop_back();
    if (pending.empty() && (packets == packets_over_loopback() || work == work_so_far())) {
      packets_at_rest_ = packets;
      for (auto& [name, node] : nodes_) node.may_have_polled = false;
      return;
    }
    if (!pending.empty()) pending.back()->second.waited += kBetweenLooks;
    if (looks % kLooksAtAll != 0) continue;
    for (auto* one : pending) {
      auto& [name, node] = *one;
      if (rests(node)) continue;
      awake[name] += name == ros::this_node::getName() || name == kMaster ? 1 : 2;
      const auto& all = node.processes;
      if (std::none_of(all.begin(), all.end(), std::mem_fn(&Process::is_stopped))) continue;
      const auto now = Clock::now();
      end = std::max(end, now + patience_);
      if (now < notice) continue;
      ROS_WARN("time waits for %s, which a signal (SIGSTOP) or a debugger has stopped", name.c_str());
      notice = now + kNextNotice;
    }
    if (Clock::now() < end) continue;
    give_up(awake, looks / kLooksAtAll);
    return await_sleep();
  }
}

bool ClockFollowers::rests(Node& node) {
  const auto start = Clock::now();
  const bool rest = std::all_of(node.processes.begin(), node.processes.end(), std::mem_fn(&Process::rests));
  node.waited += Clock::now() - start;
  return rest;
}

std::uint64_t ClockFollowers::work_so_far() {
  std::uint64_t work = 0;
  for (auto& [name, node] : nodes_) work += node.rests_to_return > 0 ? 0 : work_of(node.processes);
  return work;
}

/// Names, once, nodes with many threads: a look at each of them takes its time.
void ClockFollowers::warn_of_threads() {
  for (auto& [name, node] : nodes_) {
    std::size_t threads = 0;
    for (const Process& process : node.processes) threads += process.threads();
    if (threads < kManyThreads || std::exchange(node.is_named, true)) continue;
    ROS_WARN("%s has %zu threads, and time waits for all: %.2g ms of wall time a step", name.c_str(), threads,
             std::chrono::duration<double, std::milli>(node.waited).count() / static_cast<double>(steps_));
  }
}

/// Gives up the node that most looks have found at work. The gate also gives up this process where it works in half of
/// all looks.
void ClockFollowers::give_up(const std::map<std::string, int>& awake, int looks) {
  const std::string& self = ros::this_node::getName();
  const auto found =
      std::max_element(awake.begin(), awake.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (found == awake.end()) return;
  const std::string& busiest = found->first;
  const bool keeps_this_busy = awake.count(self) > 0 && awake.at(self) > looks / 2;
  ROS_WARN("%s%s has not rested for %g s%s: time no longer waits for it", busiest.c_str(),
           busiest == self ? ", this node itself," : "", std::chrono::duration<double>(patience_).count(),
           busiest != self && keeps_this_busy ? ", and keeps this node busy" : "");
  for (const std::string& name : {busiest, keeps_this_busy ? self : busiest}) {
    nodes_[name].rests_to_return = kRestsToReturn;
    given_up_.insert(name);
  }
}

/// Waits again for nodes that have been given up and rest in several steps.
void ClockFollowers::take_back() {
  for (auto& [name, node] : nodes_) {
    if (node.rests_to_return == 0) continue;
    node.rests_to_return = rests(node) ? node.rests_to_return - 1 : kRestsToReturn;
    if (node.rests_to_return == 0) ROS_WARN("%s rests again: time waits for it", name.c_str());
  }
}

}  // namespace youbot_base_sim
