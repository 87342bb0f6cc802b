# Part of youbot_base_sim's package configuration, and where it was built without ROS all of it: the target
# youbot_base_sim::core, which is everything but the node.
if(NOT TARGET youbot_base_sim::core)  # there already where both are built in one run of catkin_make
  include(CMakeFindDependencyMacro)
  find_dependency(Eigen3 NO_MODULE)
  # The targets lie beside the configuration, in devel and install spaces; this file stays in the source tree.
  include("${youbot_base_sim_DIR}/youbot_base_sim-targets.cmake")
endif()
