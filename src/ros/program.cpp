#include "youbot_base_sim/ros/program.h"

#include <ros/network.h>
#include <ros/ros.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>

#include "youbot_base_sim/ros/parameters.h"
#include "youbot_base_sim/text/print_error.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

std::atomic<bool> end_is_requested{false};

/// Makes a signal shut down ROS, and so the program, in the normal way. ROS would do this for SIGINT alone. A signal
/// that was ignored from the start, as nohup does with SIGHUP, stays so.
void end_ros_on(int signal) {
  struct sigaction action = {};
  sigaction(signal, nullptr, &action);
  if (action.sa_handler == SIG_IGN) return;
  action.sa_handler = [](int) {
    end_is_requested = true;
    ros::requestShutdown();
  };
  sigaction(signal, &action, nullptr);
}

/// A last line, which ROS's console no longer prints once ROS has shut down.
void complain(const char* name, const std::string& text) {
  if (ros::ok()) {
    ROS_FATAL_STREAM(text);
  } else {
    print_error(name, text);
  }
}

/// ros::init, whose own answer to an address of the master that it cannot read is a breakpoint. Throws ParameterError.
void init(int& argc, char** argv, const char* name) {
  const char* master = std::getenv("ROS_MASTER_URI");
  constexpr char kRemapping[] = "__master:=";
  for (int i = 1; i < argc; ++i) {
    if (std::strncmp(argv[i], kRemapping, sizeof(kRemapping) - 1) == 0) master = argv[i] + sizeof(kRemapping) - 1;
  }
  std::string host;
  std::uint32_t port = 0;
  if (!master || !ros::network::splitURI(master, host, port) || port < 1 || port > 65535) {
    throw ParameterError((master ? "ROS_MASTER_URI = " + quote(master) : "ROS_MASTER_URI is not set") +
                         ": must be http://HOST:PORT");
  }
  try {
    ros::init(argc, argv, name, ros::init_options::NoSigintHandler);
  } catch (const ros::Exception& error) {  // of names
    throw ParameterError(error.what());
  }
}

}  // namespace

const std::atomic<bool>& end_requested() { return end_is_requested; }

int run_program(int argc, char** argv, const char* name, const std::function<void()>& body) {
  try {
    init(argc, argv, name);
  } catch (const ParameterError& error) {
    print_error(name, error.what());
    return 2;
  }
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) end_ros_on(signal);
  if (argc > 1) {
    ROS_FATAL("unexpected argument %s: %s takes ROS parameters, as _scene:=FILE, and remappings only",
              quote(argv[1]).c_str(), name);
    return 2;
  }
  const ros::NodeHandle keep_alive;  // ROS shuts down, its log included, with the last handle
  if (!ros::ok()) {                  // an interrupted wait for a master leaves its objects unusable
    complain(name, "interrupted before there was a master at " + ros::master::getURI());
    return 1;
  }
  try {
    body();
  } catch (const ParameterError& error) {
    complain(name, error.what());
    return 2;
  } catch (const std::exception& error) {
    complain(name, error.what());
    return 1;
  }
  return 0;
}

}  // namespace youbot_base_sim
