#include "youbot_base_sim/ros/frame_names.h"

namespace youbot_base_sim {

namespace {

std::string without_slash(const std::string& name) { return name.front() == '/' ? name.substr(1) : name; }

}  // namespace

FrameNames FrameNames::of(const std::string& tf_prefix, const std::string& odom, const std::string& base,
                          const std::string& world) {
  FrameNames frames;
  if (!tf_prefix.empty()) frames.prefix = without_slash(tf_prefix) + "/";
  const auto prefixed = [&](const std::string& name) {
    return name.front() == '/' ? without_slash(name) : frames.prefix + name;
  };
  frames.odom = prefixed(odom);
  frames.base = prefixed(base);
  frames.world = without_slash(world);
  frames.truth = frames.prefix + kTruthPrefix + without_slash(base);
  return frames;
}

}  // namespace youbot_base_sim
