// With a description of the user's own, with arm, gripper and laser: it stays, and the frames of all its links hang on
// odom once rostopic publishes their joints beside those of the base.

#include "base_process.h"
#include "frame_tree.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

TEST(OwnDescription, is_kept_and_its_frames_are_one_tree) {
  ros::NodeHandle node;
  FrameTree frames;
  frames.listen();
  const std::set<std::string> last = {"base_footprint", "wheel_link_br", "base_laser_front_link", "arm_link_2",
                                      "gripper_finger_link_l"};
  wait_for("all links", [&] {
    return std::all_of(last.begin(), last.end(), [&](const std::string& link) { return frames.has(link); });
  });
  frames.expect_whole("odom");
  std::string description;
  ASSERT_TRUE(node.getParam("/robot_description", description));
  EXPECT_NE(description.find("arm_joint_2"), std::string::npos);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
