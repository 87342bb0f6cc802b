# Tests of what needs ROS. The programs with a master are rostests, one a behaviour.
find_package(catkin REQUIRED COMPONENTS roslaunch rosbag_storage rostest tf2_ros)

set(ros_test_names bag_test conversions_test)
foreach(name ${ros_test_names})
  add_executable(${name} ${name}.cpp)
  target_link_libraries(${name} GTest::gtest GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name})
endforeach()

set(rostest_names bad_commands cmd_vel command_rate command_timeout delayed_commands diagnostics driver_launch
  dry_friction encoder_faults ethercat_loss floods joint_signs motor_services odometry_covariance paper_case quantized
  silent_motor time_services torques_command transforms velocity_command wall_clock wrong_configuration)
foreach(name ${rostest_names})
  add_rostest_gtest(${name}_rostest ${name}.test ${name}_rostest.cpp)
  target_compile_definitions(${name}_rostest PRIVATE BASE_NODE="$<TARGET_FILE:base_node>"
    PLAY_SCENE="$<TARGET_FILE:play_scene>")
  list(APPEND ros_test_names ${name}_rostest)
endforeach()
target_link_libraries(transforms_rostest ${catkin_LIBRARIES})

# ROS's headers take longer to read than the tests behind them.
list(GET rostest_names 0 first)
target_precompile_headers(${first}_rostest PRIVATE base_client.h)
foreach(name ${rostest_names})
  if(NOT name STREQUAL first)
    target_precompile_headers(${name}_rostest REUSE_FROM ${first}_rostest)
  endif()
endforeach()

foreach(name ${ros_test_names})
  target_link_libraries(${name} youbot_base_sim_ros)
  target_compile_definitions(${name} PRIVATE YOUBOT_BASE_SIM_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL FALSE)  # catkin leaves its tests out of the default build
  youbot_base_sim_warnings(${name})
endforeach()

roslaunch_add_file_check(${PROJECT_SOURCE_DIR}/launch/paper_case.launch)
roslaunch_add_file_check(${PROJECT_SOURCE_DIR}/launch/base.launch)
roslaunch_add_file_check(${PROJECT_SOURCE_DIR}/launch/youbot_driver.launch)

# The system's Python first, for the ROS tools that start with "env python3"; ROS_HOSTNAME for machines that cannot
# resolve their own name.
get_filename_component(python_dir ${PYTHON_EXECUTABLE} DIRECTORY)
get_property(all_tests DIRECTORY PROPERTY TESTS)
set_tests_properties(${all_tests} PROPERTIES
  TIMEOUT 120
  ENVIRONMENT "PATH=${python_dir}:$ENV{PATH};ROS_HOSTNAME=localhost;ROS_LOG_DIR=${CMAKE_BINARY_DIR}/test_results/log")
