# Three images. All take their versions from requirements.lock.
#   docker build --tag awarenav .                       what runs on a robot: `awarenav bridge`, …
#   docker build --tag awarenav-ros2 --target ros2 .    beside ROS 2 Jazzy, with the launch file
#   docker build --tag awarenav-dev --target dev .      for development: .devcontainer
#
# The bridge speaks DDS with ROS on the host:
#   docker run --rm --network host --volume "$PWD:/work" awarenav bridge --robot robot.yaml
# Fetched networks are in the folder networks of that volume.

# Development: make, git and Python. `make setup` installs the lock into the checkout's .venv.
FROM python:3.11-slim-bookworm AS dev
# Versions are those of the distribution.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends git make \
    && rm -rf /var/lib/apt/lists/*
RUN useradd --uid 1000 --create-home developer
USER 1000
WORKDIR /home/developer

# Beside ROS 2: a Python of its own, since the packages of ROS's Python are not touched.
FROM ros:jazzy-ros-base AS ros2
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        python3-venv ros-jazzy-nav2-msgs ros-jazzy-rmw-cyclonedds-cpp \
    && rm -rf /var/lib/apt/lists/*
ENV RMW_IMPLEMENTATION=rmw_cyclonedds_cpp \
    AWARENAV_MODELS=/work/networks \
    PIP_NO_CACHE_DIR=1 \
    PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /opt/awarenav
COPY requirements.lock pyproject.toml README.md LICENSE ./
COPY perception ./perception
COPY tracking ./tracking
COPY nav_adapter ./nav_adapter
COPY awarenav ./awarenav
COPY sim_tests ./sim_tests
RUN python3 -m venv .venv \
    && .venv/bin/python -m pip install --constraint requirements.lock '.[ros2,rosbag]' \
    && ln -s /opt/awarenav/.venv/bin/awarenav /usr/local/bin/awarenav
COPY docs/nav2 ./docs/nav2
WORKDIR /work
CMD ["ros2", "launch", "/opt/awarenav/docs/nav2/awarenav.launch.yaml", \
     "robot:=/opt/awarenav/docs/nav2/robot.yaml"]

# What runs on a robot, without ROS and without the simulator. The last stage is the default.
FROM python:3.11-slim-bookworm AS robot
ENV AWARENAV_MODELS=/work/networks \
    PIP_NO_CACHE_DIR=1 \
    PIP_DISABLE_PIP_VERSION_CHECK=1
WORKDIR /opt/awarenav
COPY requirements.lock pyproject.toml README.md LICENSE ./
COPY perception ./perception
COPY tracking ./tracking
COPY nav_adapter ./nav_adapter
COPY awarenav ./awarenav
COPY sim_tests ./sim_tests
RUN python -m pip install --constraint requirements.lock '.[ros2,rosbag]' \
    && useradd --uid 1000 --create-home robot
USER 1000
WORKDIR /work
ENTRYPOINT ["awarenav"]
CMD ["--help"]
