# catkin keeps for the tests how the devel space changes the environment of this shell. Where that has sourced it already,
# nothing would change: take back what it has set, so that tests run in any other shell too.
if(CATKIN_DEVEL_PREFIX AND "$ENV{CMAKE_PREFIX_PATH}" MATCHES "(^|:)${CATKIN_DEVEL_PREFIX}(:|$)")
  #catkin_lint: skip  (it takes any changed variable for a mistake)
  foreach(variable CMAKE_PREFIX_PATH LD_LIBRARY_PATH PATH PKG_CONFIG_PATH PYTHONPATH ROSLISP_PACKAGE_DIRECTORIES
      ROS_PACKAGE_PATH)
    string(REPLACE ":" ";" entries "$ENV{${variable}}")
    list(FILTER entries EXCLUDE REGEX "^(${CATKIN_DEVEL_PREFIX}(/.*)?|${CMAKE_SOURCE_DIR}(/msg/brics_actuator)?)$")
    list(JOIN entries ":" entries)
    if(entries)
      set(ENV{${variable}} "${entries}")
    else()
      unset(ENV{${variable}})
    endif()
  endforeach()
  foreach(variable ROS_DISTRO ROS_ETC_DIR ROS_MASTER_URI ROS_PYTHON_VERSION ROS_VERSION)
    unset(ENV{${variable}})
  endforeach()
endif()
