# Untested: docker build -f examples/ci/one.Dockerfile -t youbot_base_sim . With UBUNTU=24.04, too.
ARG UBUNTU=22.04
FROM ubuntu:${UBUNTU}
SHELL ["/bin/bash", "-c"]
ENV DEBIAN_FRONTEND=noninteractive
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates curl lsb-release \
    && curl -sSL https://ros.packages.techfak.net/gpg.key -o /usr/share/keyrings/ros-one.gpg \
    && echo "deb [signed-by=/usr/share/keyrings/ros-one.gpg] https://ros.packages.techfak.net $(lsb_release -cs) main" \
    >/etc/apt/sources.list.d/ros-one.list
RUN apt-get update && apt-get install -y g++ make python3-rosdep ros-one-ros-base \
    && (rosdep init || true) \
    && echo "yaml https://ros.packages.techfak.net/ros-one.yaml one" >/etc/ros/rosdep/sources.list.d/1-ros-one.list \
    && rosdep update
WORKDIR /catkin_ws
COPY . src/youbot_base_sim
RUN source /opt/ros/one/setup.bash && rosdep install -y --from-paths src --ignore-src --rosdistro one \
    && catkin_make -DCMAKE_BUILD_TYPE=Release
CMD ["bash", "-c", "source devel/setup.bash && roslaunch youbot_base_sim youbot_driver.launch"]
