#include "youbot_base_sim/ros/program.h"

#include <fmt/format.h>
#include <ros/network.h>
#include <ros/ros.h>

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

using XmlRpc::XmlRpcValue;

std::string shown(XmlRpcValue& value) {
  if (value.getType() == XmlRpcValue::TypeString) return fmt::format("\"{}\"", static_cast<std::string>(value));
  if (value.getType() == XmlRpcValue::TypeBoolean) return static_cast<bool>(value) ? "true" : "false";
  std::ostringstream text;
  text << value;
  return text.str();
}

/// A number, or a text that is one: YAML, as of roslaunch, takes 1e-5 for a text.
bool read_number(XmlRpcValue& value, double& number) {
  const auto type = value.getType();
  if (type == XmlRpcValue::TypeString) return youbot_base_sim::read_number(static_cast<std::string>(value), number);
  if (type == XmlRpcValue::TypeInt) number = static_cast<int>(value);
  if (type == XmlRpcValue::TypeDouble) number = static_cast<double>(value);
  return type == XmlRpcValue::TypeInt || type == XmlRpcValue::TypeDouble;
}

/// ROS's console prints nothing once ROS has shut down.
void complain(const char* name, const std::string& text) {
  if (ros::ok()) {
    ROS_FATAL_STREAM(text);
  } else {
    print_error(name, text);
  }
}

/// ros::init, which itself ends in a breakpoint where it cannot read the master's address. Throws ParameterError.
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

void Parameters::require(bool holds, const std::string& name, const std::string& value,
                         const std::string& allowed) const {
  if (holds) return;
  throw ParameterError(fmt::format("parameter {}{} = {}: must be {}", prefix_, name, quote(value), allowed));
}

bool Parameters::get(const std::string& name, XmlRpcValue& value) {
  known_.insert(name);
  if (!node_.getParam(name, value)) return false;
  if (value.getType() != XmlRpcValue::TypeString) return true;
  const std::string& text = value;
  return !text.empty() && text != "unset";
}

bool Parameters::read(const std::string& name, std::string& value) {
  XmlRpcValue set;
  if (!get(name, set)) return false;
  require(set.getType() == XmlRpcValue::TypeString, name, shown(set), "a text");
  value = static_cast<std::string>(set);
  return true;
}

bool Parameters::read(const std::string& name, bool& value) {
  XmlRpcValue set;
  if (!get(name, set)) return false;
  require(set.getType() == XmlRpcValue::TypeBoolean, name, shown(set), "true or false");
  value = static_cast<bool>(set);
  return true;
}

bool Parameters::read(const std::string& name, double& value, const Range& range) {
  XmlRpcValue set;
  if (!get(name, set)) return false;
  double number;
  require(read_number(set, number) && contains(range, number), name, shown(set), text_of(range));
  value = number;
  return true;
}

bool Parameters::read(const std::string& name, Eigen::Ref<Eigen::ArrayXd> values, const Range& range) {
  XmlRpcValue set;
  if (!get(name, set)) return false;
  bool holds = set.getType() == XmlRpcValue::TypeArray && set.size() == values.size();
  for (int i = 0; holds && i < set.size(); ++i) holds = read_number(set[i], values[i]) && contains(range, values[i]);
  require(holds, name, shown(set), fmt::format("a list of {} numbers, each {}", values.size(), text_of(range)));
  return true;
}

bool Parameters::read(const std::string& name, std::vector<std::string>& texts) {
  XmlRpcValue set;
  if (!get(name, set)) return false;
  require(node_.getParam(name, texts) && !texts.empty(), name, shown(set), "a list of texts");
  return true;
}

bool Parameters::search(const std::string& name, std::string& value) const {
  std::string key;
  return node_.searchParam(name, key) && Parameters(node_, "").read(key, value);
}

void Parameters::refuse_others() const {
  std::vector<std::string> names;
  node_.getParamNames(names);
  const std::string mine = node_.getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.rfind(mine, 0) != 0) continue;
    const std::string key = name.substr(mine.size(), name.find('/', mine.size()) - mine.size());
    if (known_.count(key)) continue;
    throw ParameterError(
        fmt::format("parameter {}{} is unknown; known: {}", prefix_, quote(key), fmt::join(known_, " ")));
  }
}

int run_program(int argc, char** argv, const char* name, const std::function<void()>& body) {
  try {
    init(argc, argv, name);
  } catch (const ParameterError& error) {
    print_error(name, error.what());
    return 2;
  }
  std::signal(SIGINT,
              SIG_DFL);  // a shell without job control starts `base_node &` with it ignored; ROS ends all the same
  catch_signals(&ros::requestShutdown);  // ROS would do this for SIGINT alone
  if (argc > 1) {
    ROS_FATAL("unexpected argument %s: %s takes only ROS parameters, such as _scene:=FILE, and remappings",
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
