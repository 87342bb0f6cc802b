# The library; and the messages, as catkin describes them, where libyoubot-base-sim-msgs-dev is installed.
include("${CMAKE_CURRENT_LIST_DIR}/youbot_base_sim-extras.cmake")
get_filename_component(youbot_base_sim_messages "${CMAKE_CURRENT_LIST_DIR}/../../../../share/youbot_base_sim/cmake" ABSOLUTE)
if(EXISTS "${youbot_base_sim_messages}/youbot_base_simConfig.cmake")
  set(youbot_base_sim_DIR "${youbot_base_sim_messages}")
  include("${youbot_base_sim_messages}/youbot_base_simConfig.cmake")
endif()
