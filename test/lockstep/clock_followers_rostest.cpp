// A node that follows /clock is waited for until it sleeps, whatever it says of itself, and one that never does is
// named.

#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <netinet/in.h>
#include <ros/master.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Log.h>
#include <std_msgs/Empty.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <future>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "ros/base_process.h"
#include "ros/rostest.h"
#include "youbot_base_sim/lockstep/clock_followers.h"
#include "youbot_base_sim/lockstep/step_reports.h"

namespace youbot_base_sim {
namespace {

/// A process that the master takes for a node, but that never answers. It sleeps; a signal wakes it: SIGUSR1 for a
/// fifth of a second of work, after most of a millisecond, as a loop of roscpp by simulated time; SIGUSR2 for ever;
/// SIGHUP for looking at the time each millisecond, beside threads that sleep, as a roscpp node with a timer, and
/// then SIGUSR1 for one look that is 8 ms late and leads to a fifth of a second of work.
class SilentNode {
 public:
  explicit SilentNode(const std::string& name, const std::string& host = "localhost", int threads = 7)
      : name_(name), host_(host), program_(PYTHON, {"-c", kProgram, std::to_string(threads)}) {
    wait_for("the node's port", [this] { return program_.out().find('\n') != std::string::npos; });
    call("registerSubscriber", {"/nothing", "std_msgs/Empty", uri()});
  }
  ~SilentNode() { call("unregisterSubscriber", {"/nothing", uri()}); }

  void send(int signal) {
    program_.send(signal);
    ros::master::check();  // packets, without which nothing wakes a node of ROS
  }
  bool says(const std::string& word) const { return program_.out().find(word) != std::string::npos; }
  bool has_worked() const { return says("done"); }

 private:
  static constexpr char kProgram[] = R"(
import signal, socket, sys, threading, time
signals = {signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP}
signal.pthread_sigmask(signal.SIG_BLOCK, signals)
server = socket.create_server(("localhost", 0))
never = threading.Lock()
never.acquire()
def sleep(seconds):
    never.acquire(timeout=seconds)  # as a timer of roscpp; time.sleep calls select until Python 3.10
print(server.getsockname()[1], flush=True)
def sleep_and_work(delay):
    sleep(delay)
    end = time.monotonic() + 0.2
    while time.monotonic() < end:
        pass
    print("done", flush=True)
while (woken_by := signal.sigwait(signals)) == signal.SIGUSR1:
    sleep_and_work(0.0008)
if woken_by == signal.SIGHUP:
    for _ in range(int(sys.argv[1])):
        threading.Thread(target=threading.Event().wait, daemon=True).start()
    print("polls", flush=True)
while True:
    if woken_by == signal.SIGHUP:
        sleep(0.001)
        if signal.sigtimedwait(signals, 0):
            print("late", flush=True)
            sleep_and_work(0.008)
)";

  std::string uri() const { return "http://" + host_ + ":" + std::to_string(std::stoi(program_.out())) + "/"; }

  void call(const char* method, const std::vector<std::string>& arguments) const {
    XmlRpc::XmlRpcValue request, response, payload;
    request[0] = name_;
    for (std::size_t i = 0; i < arguments.size(); ++i) request[static_cast<int>(i + 1)] = arguments[i];
    if (!ros::master::execute(method, request, response, payload, false)) throw std::runtime_error(method);
  }

  std::string name_, host_;
  Program program_;
};

constexpr auto kPatience = std::chrono::seconds(2);
std::atomic<bool> stop{false};

/// Followers of a /clock without connections: what wakes the nodes here is a signal.
class Followers : public ClockFollowers {
 public:
  explicit Followers(const std::vector<std::string>& nodes = {}, std::chrono::duration<double> patience = kPatience)
      : ClockFollowers(node(), patience, stop) {
    for (const std::string& node : nodes) add(node);
    await_rest();
  }

  void step() {
    announce(time_ += ros::Duration(0.01));
    await_rest();
  }

 private:
  ros::Time time_;

  static ros::NodeHandle& node() {
    static ros::NodeHandle node;
    return node;
  }
};

TEST(ClockFollowers, are_waited_for_though_they_never_answer) {
  SilentNode node("/silent");
  Followers followers({"/silent"});
  EXPECT_FALSE(node.has_worked());
  node.send(SIGUSR1);
  followers.step();
  EXPECT_TRUE(node.has_worked());
}

/// What this process warns of.
class Warnings {
 public:
  Warnings() {
    subscriber_ = node_.subscribe<rosgraph_msgs::Log>("/rosout", 1000, [this](const auto& line) {
      if (line->level == rosgraph_msgs::Log::WARN && line->name == ros::this_node::getName())
        lines_ += line->msg + "\n";
    });
    wait_for("the log", [this] {
      ROS_WARN("heard");
      return has("heard");
    });
  }
  bool has(const std::string& word) const { return lines_.find(word) != std::string::npos; }
  const std::string& lines() {
    const std::string end = "end " + std::to_string(++ends_);
    ROS_WARN_STREAM(end);
    wait_for("the end", [&] { return has(end); });
    return lines_;
  }

 private:
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  std::string lines_;
  int ends_ = 0;
};

TEST(ClockFollowers, one_that_never_rests_is_named_and_given_up) {
  SilentNode restless("/a_restless"), idle("/b_idle");
  Followers followers({"/a_restless", "/b_idle"});
  Warnings warnings;
  restless.send(SIGUSR2);
  followers.await_rest();
  wait_for("a warning", [&] { return warnings.has("/a_restless has not rested for 2 s"); });
  EXPECT_EQ(warnings.lines().find("/b_idle"), std::string::npos) << warnings.lines();
  EXPECT_NE(followers.broken_promise().find("not waited for /a_restless:"), std::string::npos);
  idle.send(SIGUSR1);
  followers.step();
  EXPECT_TRUE(idle.has_worked()) << "the others are waited for as before";
}

TEST(ClockFollowers, one_that_was_given_up_is_waited_for_again_when_it_rests) {
  SilentNode slow("/slow");
  Followers followers({"/slow"}, std::chrono::milliseconds(50));
  Warnings warnings;
  while (followers.counters().at("nodes given up").find("/slow") == std::string::npos) {
    slow.send(SIGUSR1);
    followers.step();
  }
  wait_for("a rest", [&] {
    followers.step();
    return warnings.has("/slow rests again");
  });
  EXPECT_NE(followers.broken_promise(), "") << "for all that";
}

TEST(ClockFollowers, one_that_sends_late_is_named_once_and_counted) {
  Followers followers;
  Warnings warnings;
  for (int k = 0; k < 3; ++k) followers.note_late("/late");
  EXPECT_EQ(warnings.lines().find("/late"), warnings.lines().rfind("/late")) << warnings.lines();
  EXPECT_TRUE(warnings.has("/late commands while all nodes rest")) << warnings.lines();
  EXPECT_NE(followers.counters().at("late commands").find("\"/late\": 3"), std::string::npos);
}

TEST(ClockFollowers, one_that_is_stopped_is_named_and_waited_for_unless_this_process_ends) {
  SilentNode node("/stopped"), idle("/idle");
  Followers followers({"/stopped", "/idle"});
  Warnings warnings;
  node.send(SIGSTOP);
  node.send(SIGUSR1);
  const auto rest = std::async(std::launch::async, [&] { followers.step(); });
  wait_for("a warning", [&] { return warnings.has("time waits for /stopped, which a signal (SIGSTOP)"); });
  EXPECT_EQ(rest.wait_for(kPatience), std::future_status::timeout);
  EXPECT_FALSE(node.has_worked());
  stop = true;
  rest.wait();
  stop = false;
  node.send(SIGCONT);
  followers.step();
  EXPECT_TRUE(node.has_worked());
  EXPECT_EQ(warnings.lines().find("has not rested"), std::string::npos) << warnings.lines();
}

TEST(ClockFollowers, one_that_is_stopped_is_named_beside_a_busy_one) {
  SilentNode restless("/a_restless"), stopped("/b_stopped");
  Followers followers({"/a_restless", "/b_stopped"});
  Warnings warnings;
  stopped.send(SIGSTOP);
  restless.send(SIGUSR2);
  const auto rest = std::async(std::launch::async, [&] { followers.await_rest(); });
  wait_for("a warning", [&] { return warnings.has("time waits for /b_stopped"); });
  EXPECT_EQ(warnings.lines().find("has not rested"), std::string::npos) << warnings.lines();
  stopped.send(SIGCONT);
  wait_for("a warning", [&] { return warnings.has("/a_restless has not rested"); });
  rest.wait();
  EXPECT_EQ(warnings.lines().find("/b_stopped has not rested"), std::string::npos) << warnings.lines();
}

// The test is its parent, and asks for its end only after.
TEST(ClockFollowers, one_that_has_ended_is_not_waited_for) {
  SilentNode node("/ended");
  Followers followers({"/ended"});
  Warnings warnings;
  node.send(SIGKILL);
  followers.await_rest();
  EXPECT_EQ(warnings.lines().find("has not rested"), std::string::npos) << warnings.lines();
}

// As on virtual machines, where a sleep of a millisecond takes several now and then.
TEST(ClockFollowers, one_that_polls_is_waited_for_though_late) {
  SilentNode node("/polls");
  Followers followers({"/polls"});
  node.send(SIGHUP);
  wait_for("polls", [&] { return node.says("polls"); });
  for (int k = 0; k < 10; ++k) followers.step();
  node.send(SIGUSR1);
  while (!node.says("late")) std::this_thread::sleep_for(std::chrono::microseconds(100));
  followers.step();
  EXPECT_TRUE(node.has_worked());
}

TEST(ClockFollowers, one_with_many_threads_is_named_once) {
  SilentNode many("/many", "localhost", 150), few("/few");
  Followers followers({"/many", "/few"});
  Warnings warnings;
  for (SilentNode* node : {&many, &few}) {
    node->send(SIGHUP);
    wait_for("threads", [&] { return node->says("polls"); });
  }
  for (int k = 0; k < 30; ++k) followers.step();
  wait_for("a warning", [&] { return warnings.has("/many has 151 threads"); });
  EXPECT_EQ(warnings.lines().find("threads"), warnings.lines().rfind("threads")) << warnings.lines();
}

TEST(ClockFollowers, several_rest_between_their_polls) {
  Warnings warnings;
  Followers followers;
  std::vector<std::unique_ptr<SilentNode>> nodes;
  for (const std::string name : {"/a", "/b", "/c", "/d", "/e", "/f"}) {
    nodes.push_back(std::make_unique<SilentNode>(name));
    followers.add(name);
    nodes.back()->send(SIGHUP);
    wait_for("polls", [&] { return nodes.back()->says("polls"); });
  }
  for (int k = 0; k < 3; ++k) followers.await_rest();
  EXPECT_EQ(warnings.lines().find("has not rested"), std::string::npos) << warnings.lines();
}

/// Waits for `followers` while a thread of this process never rests.
void await_rest_beside_busy_thread(ClockFollowers& followers) {
  std::atomic<bool> done{false};
  std::thread busy([&done] {
    while (!done) continue;
  });
  followers.await_rest();
  done = true;
  busy.join();
}

TEST(ClockFollowers, this_process_is_named_where_it_never_rests) {
  SilentNode idle("/idle");
  Followers followers({"/idle"});
  Warnings warnings;
  await_rest_beside_busy_thread(followers);
  wait_for("a warning", [&] { return warnings.has("this node itself, has not rested"); });
  EXPECT_EQ(warnings.lines().find("/idle"), std::string::npos) << warnings.lines();
}

// The node's name comes last, where the first one seen at work would be blamed.
TEST(ClockFollowers, one_that_keeps_this_process_busy_is_named_alone) {
  SilentNode restless("/z_restless");
  Followers followers({"/z_restless"});
  Warnings warnings;
  restless.send(SIGUSR2);
  await_rest_beside_busy_thread(followers);
  wait_for("a warning", [&] { return warnings.has("/z_restless has not rested for 2 s, and keeps this node busy"); });
  EXPECT_EQ(warnings.lines().find("itself"), std::string::npos) << warnings.lines();
}

// As where ROS_IP is set for one terminal and not for another.
TEST(ClockFollowers, one_is_waited_for_by_any_address_of_this_machine) {
  Warnings warnings;
  std::set<std::string> hosts = {"127.0.0.2"};
  ifaddrs* interfaces = nullptr;
  getifaddrs(&interfaces);
  for (const ifaddrs* one = interfaces; one; one = one->ifa_next) {
    char name[NI_MAXHOST] = "";
    if (!one->ifa_addr || one->ifa_addr->sa_family != AF_INET) continue;
    getnameinfo(one->ifa_addr, sizeof(sockaddr_in), name, sizeof(name), nullptr, 0, NI_NUMERICHOST);
    hosts.insert(name);
  }
  freeifaddrs(interfaces);
  for (const std::string& host : hosts) {
    SilentNode node("/addressed", host);
    Followers followers({"/addressed"});
    node.send(SIGUSR1);
    followers.step();
    EXPECT_TRUE(node.has_worked()) << host;
  }
  EXPECT_EQ(warnings.lines().find("from elsewhere"), std::string::npos) << warnings.lines();
}

TEST(ClockFollowers, one_that_cannot_be_seen_is_named) {
  Warnings warnings;
  const SilentNode absent("/absent", "192.0.2.1");
  Followers followers({"/absent", "/gone"});
  wait_for("a warning", [&] { return warnings.has("/absent follows /clock from elsewhere"); });
  EXPECT_FALSE(warnings.has("/gone"));
}

TEST(ClockFollowers, node_that_takes_over_a_name_hears_the_time) {
  constexpr char kListener[] = R"(
import rospy, rosgraph_msgs.msg
rospy.init_node("listener")
rospy.Subscriber("/clock", rosgraph_msgs.msg.Clock, lambda message: print("heard", flush=True))
rospy.spin()
)";
  ros::NodeHandle node;
  ClockLinks links(node);
  std::vector<std::pair<std::string, bool>> changes;
  const auto wait_for_changes = [&](std::size_t n) {
    wait_for("a node that comes or goes", [&] {
      for (const auto& change : links.take_changes()) changes.push_back(change);
      return changes.size() >= n;
    });
  };
  Program first(PYTHON, {"-c", kListener});
  wait_for_changes(1);
  Program second(PYTHON, {"-c", kListener});
  wait_for_changes(3);  // it comes, and the first goes
  EXPECT_TRUE(changes.back().second);
  wait_for("the time", [&] {
    links.set_time(ros::Time(1));
    links.send("/listener");
    return second.out().find("heard") != std::string::npos;
  });
}

// All may sleep before the master informs a subscriber, and before roscpp connects.
TEST(ClockFollowers, links_that_the_master_knows_of_are_waited_for) {
  constexpr char kSpeaker[] = R"(
import rospy, signal, std_msgs.msg
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGUSR1})
rospy.init_node("speaker")
for k in range(11):
    print(flush=True)
    signal.sigwait({signal.SIGUSR1})
    rospy.Publisher(f"linked_{k}", std_msgs.msg.Empty, queue_size=1)
    print(flush=True)
)";
  ros::NodeHandle node;
  const boost::function<void(const std_msgs::EmptyConstPtr&)> ignore = [](const auto&) {};
  Program speaker(PYTHON, {"-c", kSpeaker});
  const auto lines = [&] { return static_cast<int>(speaker.out().size()); };
  for (int k = 0; k < 10; ++k) {
    const std::string topic = "/linked_" + std::to_string(k);
    const ros::Subscriber subscriber = node.subscribe<std_msgs::Empty>(topic, 1, ignore);
    wait_for("the speaker", [&] { return lines() == 2 * k + 1; });
    Followers followers({"/speaker"});
    speaker.send(SIGUSR1);
    while (lines() == 2 * k + 1) std::this_thread::yield();
    followers.await_rest();
    EXPECT_EQ(subscriber.getNumPublishers(), 1u) << topic;
  }
}

TEST(StepReports, begin_with_a_silence_while_newcomers_hear_the_time) {
  Warnings warnings;
  ros::NodeHandle node;
  int sent = 0;
  const auto gate = make_step_reports(node, {"/restless"}, std::chrono::milliseconds(50), [&](ros::Time) { ++sent; });
  for (int k = 0; k < 2; ++k) gate->announce(ros::Time(1));
  EXPECT_EQ(sent, 2);
  wait_for("a warning", [&] {
    gate->note_message("/restless");
    return gate->await_rest() || warnings.has("/restless reports without a pause");
  });
  EXPECT_FALSE(gate->is_ready());
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
