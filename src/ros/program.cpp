#include "youbot_base_sim/ros/program.h"

#include <fmt/format.h>
#include <ros/network.h>
#include <ros/ros.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/scene/scene_value.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/suggestion.h"

namespace youbot_base_sim {

namespace {

using XmlRpc::XmlRpcValue;

// Defaults without a scene. The tolerance puts a minute of driving within a few micrometres, at a third of the run time
// of the scenes' default; the profile is that of a real base.
constexpr double kTolerance = 1e-5;
constexpr char kProfile[] = "measured";

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

bool Parameters::read(const std::string& name, const std::string& unset, const std::string& allowed,
                      const Decode& decode) {
  known_.insert(name);
  if (!node_) {
    fmt::print("  {:<34} {:<14} {}\n", prefix_ + name, unset.empty() ? "none" : unset, allowed);
    return false;
  }
  XmlRpcValue set;
  if (!node_->getParam(name, set)) return false;
  if (set.getType() == XmlRpcValue::TypeString) {
    const std::string& text = set;
    if (text.empty() || text == "unset") return false;
  }
  require(decode(set), name, shown(set), allowed);
  return true;
}

bool Parameters::read(const std::string& name, std::string& value, const std::string& allowed) {
  return read(name, value, allowed, [&](XmlRpcValue& set) {
    if (set.getType() != XmlRpcValue::TypeString) return false;
    value = static_cast<std::string>(set);
    return true;
  });
}

bool Parameters::read_choice(const std::string& name, std::string& value, const std::vector<std::string>& allowed) {
  if (!read(name, value, alternatives(allowed))) return false;
  const bool holds = std::find(allowed.begin(), allowed.end(), value) != allowed.end();
  require(holds, name, value, alternatives(allowed) + suggestion(value, allowed));
  return true;
}

bool Parameters::read(const std::string& name, bool& value, const char* unset) {
  return read(name, unset ? unset : fmt::format("{}", value), "true or false", [&](XmlRpcValue& set) {
    if (set.getType() != XmlRpcValue::TypeBoolean) return false;
    value = static_cast<bool>(set);
    return true;
  });
}

bool Parameters::read(const std::string& name, double& value, const Range& range, const char* unset) {
  return read(name, unset ? unset : fmt::format("{:g}", value), text_of(range), [&](XmlRpcValue& set) {
    double number = 0;
    if (!read_number(set, number) || !contains(range, number)) return false;
    value = number;
    return true;
  });
}

bool Parameters::read(const std::string& name, Eigen::Ref<Eigen::ArrayXd> values, const Range& range,
                      const char* unset) {
  const std::string allowed = fmt::format("a list of {} numbers, each {}", values.size(), text_of(range));
  return read(name, unset ? unset : fmt::format("[{:g}]", fmt::join(values, ", ")), allowed, [&](XmlRpcValue& set) {
    bool holds = set.getType() == XmlRpcValue::TypeArray && set.size() == values.size();
    for (int i = 0; holds && i < set.size(); ++i) holds = read_number(set[i], values[i]) && contains(range, values[i]);
    return holds;
  });
}

bool Parameters::read(const std::string& name, std::vector<std::string>& texts) {
  return read(name, "", "a list of texts",
              [&](XmlRpcValue&) { return node_->getParam(name, texts) && !texts.empty(); });
}

bool Parameters::search(const std::string& name, std::string& value, const std::string& allowed) const {
  std::string key;
  return node_ && node_->searchParam(name, key) && Parameters(*node_, "").read(key, value, allowed);
}

void Parameters::refuse_others() const {
  if (!node_) return;
  std::vector<std::string> names;
  node_->getParamNames(names);
  const std::string mine = node_->getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.rfind(mine, 0) != 0) continue;
    const std::string key = name.substr(mine.size(), name.find('/', mine.size()) - mine.size());
    if (known_.count(key)) continue;
    throw ParameterError(fmt::format("parameter {}{} is unknown; known: {}{}", prefix_, quote(key),
                                     fmt::join(known_, " "), suggestion(key, {known_.begin(), known_.end()})));
  }
}

Scene read_scene(Parameters& parameters, SceneSettings settings) {
  std::string path, profile;
  double friction_scale = 1;
  parameters.read("scene", path, "a scene file");
  if (path.empty()) {
    profile = kProfile;
    settings.insert(settings.begin(), {"solver.relative_tolerance", kTolerance});  // later ones replace it
  }
  parameters.read_choice("profile", profile, profile_names());
  SceneSetting setting("robot.profile", profile, true);
  if (parameters.read("friction_scale", friction_scale, kFrictionScales)) {
    parameters.require(profile == "measured", "friction_scale", fmt::format("{:g}", friction_scale),
                       "left out unless profile = measured is given too");
    setting = {"robot.profile", fmt::format("{{name: measured, friction_scale: {}}}", friction_scale)};
  }
  if (!profile.empty()) settings.push_back(setting);
  try {
    return path.empty() ? default_scene(settings, SceneUse::kCommands)
                        : load_scene(path, settings, SceneUse::kCommands);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter ~scene: {}", error.what()));
  }
}

int run_program(int argc, char** argv, const char* name, const std::function<void()>& body, const char* about,
                const std::function<void()>& describe) {
  if (std::find(argv + 1, argv + argc, std::string("--help")) != argv + argc) {
    fmt::print("{} [_PARAMETER:=VALUE ..] [TOPIC:=NAME ..]\n{}\n\n  {:<34} {:<14} allowed\n", name, about, "parameter",
               "default");
    describe();
    return std::fflush(stdout) == 0 ? 0 : 1;
  }
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
    ROS_FATAL(
        "unexpected argument %s: %s takes only ROS parameters, such as _scene:=FILE, and remappings; "
        "--help lists them",
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
