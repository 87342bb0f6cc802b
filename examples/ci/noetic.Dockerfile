# Untested: docker build -f examples/ci/noetic.Dockerfile -t youbot_base_sim .
FROM ros:noetic-ros-base
SHELL ["/bin/bash", "-c"]
WORKDIR /catkin_ws
COPY . src/youbot_base_sim
RUN apt-get update && rosdep update --include-eol-distros && rosdep install -y --from-paths src --ignore-src
RUN source /opt/ros/noetic/setup.bash && catkin_make -DCMAKE_BUILD_TYPE=Release
CMD ["bash", "-c", "source devel/setup.bash && roslaunch youbot_base_sim youbot_driver.launch"]
