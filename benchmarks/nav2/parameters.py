"""Nav2's parameters for the robot of the crossings: the defaults of nav2_bringup (Jazzy), changed.

Every change is written here with its reason. The robot is 0.72 × 0.50 m, drives 1.5 m/s and brakes
at 1 m/s²; the defaults are for one of 0.22 m radius at 0.5 m/s.
"""

from __future__ import annotations

from typing import Any, Final

#: Local planners of the controller server.
CONTROLLERS: Final = ("RPP", "DWB", "MPPI")
#: What the stack reads: nothing of awarenav's; its limit; and its grid or its mask besides.
FACES: Final = ("today", "limit", "grid", "mask")

_SPEED_MPS: Final = 1.5
_ACCELERATION_MPS2: Final = 1.0
_YAW_RATE_RADPS: Final = 1.5
_FOOTPRINT: Final = "[[0.36, 0.25], [0.36, -0.25], [-0.36, -0.25], [-0.36, 0.25]]"
_SCANS: Final = ("scan", "scan_2")

_RPP: Final[dict[str, Any]] = {
    "plugin": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
    "desired_linear_vel": _SPEED_MPS,
    # 1.5 s ahead at every speed, as lookahead_time says; 0.6 m would be 0.4 s.
    "use_velocity_scaled_lookahead_dist": True,
    "lookahead_time": 1.0,
    "lookahead_dist": 1.0,
    "min_lookahead_dist": 0.5,
    "max_lookahead_dist": 1.5,
    # A turn on the spot ignores the limit: docs/nav2.md.
    "rotate_to_heading_angular_vel": 1.0,
    "max_angular_accel": 3.0,
    # The way to stop from 1.5 m/s at 1 m/s² is 1.1 m.
    "approach_velocity_scaling_dist": 1.1,
    "transform_tolerance": 0.3,
}
_DWB: Final[dict[str, Any]] = {
    "plugin": "dwb_core::DWBLocalPlanner",
    "min_vel_x": 0.0,
    "max_vel_x": _SPEED_MPS,
    "max_vel_theta": _YAW_RATE_RADPS,
    "min_speed_xy": 0.0,
    "max_speed_xy": _SPEED_MPS,
    "acc_lim_x": _ACCELERATION_MPS2,
    "decel_lim_x": -_ACCELERATION_MPS2,
    "acc_lim_theta": 3.0,
    "decel_lim_theta": -3.0,
    "vx_samples": 20,
    # It does not move sideways.
    "min_vel_y": 0.0,
    "max_vel_y": 0.0,
    "acc_lim_y": 0.0,
    "decel_lim_y": 0.0,
    "vy_samples": 1,
    "vtheta_samples": 20,
    "sim_time": 1.7,
    "linear_granularity": 0.05,
    "angular_granularity": 0.025,
    "transform_tolerance": 0.3,
    "xy_goal_tolerance": 0.25,
    "short_circuit_trajectory_evaluation": True,
    "stateful": True,
    "critics": [
        "RotateToGoal", "Oscillation", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist",
        "GoalDist",
    ],
    "BaseObstacle.scale": 0.02,
    "PathAlign.scale": 32.0,
    "PathAlign.forward_point_distance": 0.1,
    "GoalAlign.scale": 24.0,
    "GoalAlign.forward_point_distance": 0.1,
    "PathDist.scale": 32.0,
    "GoalDist.scale": 24.0,
    "RotateToGoal.scale": 32.0,
    "RotateToGoal.slowing_factor": 5.0,
    "RotateToGoal.lookahead_time": -1.0,
}  # fmt: skip
# Not sound yet: from a standstill the robot creeps or stands, and with the defaults for 0.5 m/s it
# drives backwards at 0.14 m/s. Ten variants of critics, spreads and samples did not find out why.
_MPPI: Final[dict[str, Any]] = {
    "plugin": "nav2_mppi_controller::MPPIController",
    "time_steps": 56,
    "model_dt": 0.05,
    # Half of the default, for two cores.
    "batch_size": 1000,
    "vx_std": 0.3,
    "vy_std": 0.0,
    "wz_std": 0.4,
    "vx_max": _SPEED_MPS,
    "vx_min": 0.0,
    "vy_max": 0.0,
    "wz_max": _YAW_RATE_RADPS,
    "ax_max": _ACCELERATION_MPS2,
    "ax_min": -_ACCELERATION_MPS2,
    "az_max": 3.0,
    "iteration_count": 1,
    "temperature": 0.3,
    "gamma": 0.015,
    "motion_model": "DiffDrive",
    # 2.8 s at 1.5 m/s.
    "prune_distance": 4.5,
    "regenerate_noises": True,
    "transform_tolerance": 0.3,
    "critics": [
        "ConstraintCritic", "CostCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic",
        "PathFollowCritic", "PathAngleCritic", "PreferForwardCritic",
    ],
    "ConstraintCritic": {"enabled": True, "cost_power": 1, "cost_weight": 4.0},
    "GoalCritic": {
        "enabled": True, "cost_power": 1, "cost_weight": 5.0, "threshold_to_consider": 1.4,
    },
    # Any heading will do at the goal.
    "GoalAngleCritic": {"enabled": False},
    "PreferForwardCritic": {
        "enabled": True, "cost_power": 1, "cost_weight": 5.0, "threshold_to_consider": 0.5,
    },
    "CostCritic": {
        "enabled": True, "cost_power": 1, "cost_weight": 3.81, "critical_cost": 300.0,
        # The robot is no disc.
        "consider_footprint": True,
        "collision_cost": 1000000.0, "near_goal_distance": 1.0, "trajectory_point_step": 2,
    },
    "PathAlignCritic": {
        "enabled": True, "cost_power": 1, "cost_weight": 14.0, "max_path_occupancy_ratio": 0.05,
        "trajectory_point_step": 4, "threshold_to_consider": 0.5, "offset_from_furthest": 20,
        "use_path_orientations": False,
    },
    "PathFollowCritic": {
        "enabled": True, "cost_power": 1, "cost_weight": 5.0, "offset_from_furthest": 5,
        "threshold_to_consider": 1.4,
    },
    "PathAngleCritic": {
        "enabled": True, "cost_power": 1, "cost_weight": 2.0, "offset_from_furthest": 4,
        "threshold_to_consider": 0.5, "max_angle_to_furthest": 1.0, "mode": 0,
    },
}  # fmt: skip


def parameters(controller: str, face: str) -> dict[str, Any]:
    """Return the parameters of all servers, as of a parameter file.

    Args:
        controller: one of :data:`CONTROLLERS`.
        face: one of :data:`FACES`.
    """
    local: list[str] = ["obstacle_layer", "inflation_layer"]
    if face == "grid":
        local = ["people_layer", *local]
    return {
        "controller_server": _node(
            controller_frequency=20.0,
            # The robot brakes from 1.5 m/s while a costmap is late.
            costmap_update_timeout=0.3,
            min_x_velocity_threshold=0.001,
            min_theta_velocity_threshold=0.001,
            # RPP and DWB find no command beside people; a path comes every second.
            failure_tolerance=5.0,
            progress_checker_plugins=["progress_checker"],
            goal_checker_plugins=["goal_checker"],
            controller_plugins=["FollowPath"],
            speed_limit_topic="lower_speed_limit" if face == "mask" else "speed_limit",
            progress_checker={
                "plugin": "nav2_controller::SimpleProgressChecker",
                "required_movement_radius": 0.5,
                # A robot that waits for people makes none for longer than 10 s.
                "movement_time_allowance": 60.0,
            },
            goal_checker={
                "plugin": "nav2_controller::SimpleGoalChecker",
                # Inside the goal of the crossings (0.25 m), at any heading.
                "xy_goal_tolerance": 0.2,
                "yaw_goal_tolerance": 6.3,
                "stateful": True,
            },
            FollowPath={"RPP": _RPP, "DWB": _DWB, "MPPI": _MPPI}[controller],
        ),
        "local_costmap": {
            "local_costmap": _costmap(
                "odom",
                local,
                # As docs/nav2/nav2_params.yaml.
                width=10,
                height=10,
                resolution=0.05,
                update_frequency=20.0,
                publish_frequency=1.0,
                filters=["speed_filter"] if face == "mask" else [],
                use_maximum=True,
                inflation=(0.55, 10.0),
            )
        },
        "global_costmap": {
            "global_costmap": _costmap(
                "map",
                ["static_layer", "obstacle_layer", "inflation_layer"],
                rolling=False,
                resolution=0.05,
                # The planner plans once a second.
                update_frequency=4.0,
                publish_frequency=1.0,
                # Half an aisle: paths keep away from people as far as there is room. With the
                # default (0.7, 3.0) they pass somebody at a shelf at 0.8 m.
                inflation=(1.2, 2.0),
            )
        },
        "planner_server": _node(
            expected_planner_frequency=1.0,
            planner_plugins=["GridBased"],
            GridBased={
                "plugin": "nav2_navfn_planner::NavfnPlanner",
                "tolerance": 0.5,
                "use_astar": False,
                "allow_unknown": True,
            },
        ),
        "velocity_smoother": _node(
            smoothing_frequency=20.0,
            feedback="OPEN_LOOP",
            max_velocity=[_SPEED_MPS, 0.0, _YAW_RATE_RADPS],
            min_velocity=[-_SPEED_MPS, 0.0, -_YAW_RATE_RADPS],
            max_accel=[_ACCELERATION_MPS2, 0.0, 3.0],
            max_decel=[-_ACCELERATION_MPS2, 0.0, -3.0],
            velocity_timeout=1.0,
        ),
        "behavior_server": _node(
            local_frame="odom",
            global_frame="map",
            robot_base_frame="base_link",
            transform_tolerance=0.3,
            behavior_plugins=["spin", "backup", "drive_on_heading"],
            spin={"plugin": "nav2_behaviors::Spin"},
            backup={"plugin": "nav2_behaviors::BackUp"},
            drive_on_heading={"plugin": "nav2_behaviors::DriveOnHeading"},
            # As docs/nav2/nav2_params.yaml.
            max_rotational_vel=0.55,
            min_rotational_vel=0.2,
            rotational_acc_lim=3.0,
            simulate_ahead_time=2.0,
        ),
        "collision_monitor": _node(**_monitor(people=face != "today")),
    }


def _node(**values: Any) -> dict[str, Any]:
    return {"ros__parameters": {"use_sim_time": True, **values}}


def _costmap(
    frame: str,
    plugins: list[str],
    *,
    inflation: tuple[float, float],
    rolling: bool = True,
    filters: list[str] | None = None,
    **values: Any,
) -> dict[str, Any]:
    """Return the parameters of a costmap with both scans."""
    radius_m, scaling = inflation
    sources = {
        name: {
            "topic": f"/{name}",
            "data_type": "LaserScan",
            "clearing": True,
            "marking": True,
            "obstacle_max_range": 8.0,
            "raytrace_max_range": 9.0,
            "max_obstacle_height": 2.0,
            "inf_is_valid": True,
        }
        for name in _SCANS
    }
    more: dict[str, Any] = {"filters": filters} if filters else {}
    return _node(
        global_frame=frame,
        robot_base_frame="base_link",
        rolling_window=rolling,
        footprint=_FOOTPRINT,
        transform_tolerance=0.3,
        plugins=plugins,
        static_layer={
            "plugin": "nav2_costmap_2d::StaticLayer",
            "map_topic": "/map",
            "map_subscribe_transient_local": True,
        },
        people_layer={
            "plugin": "nav2_costmap_2d::StaticLayer",
            "map_topic": "/awarenav/people_grid",
            "map_subscribe_transient_local": True,
            "subscribe_to_updates": False,
        },
        # No voxels: scanners see one height.
        obstacle_layer={
            "plugin": "nav2_costmap_2d::ObstacleLayer",
            "observation_sources": " ".join(_SCANS),
            **sources,
        },
        inflation_layer={
            "plugin": "nav2_costmap_2d::InflationLayer",
            "inflation_radius": radius_m,
            "cost_scaling_factor": scaling,
        },
        speed_filter={
            "plugin": "nav2_costmap_2d::SpeedFilter",
            "enabled": True,
            "filter_info_topic": "/awarenav/speed_mask_info",
            "speed_limit_topic": "/mask_speed_limit",
        },
        **more,
        **values,
    )


def _monitor(*, people: bool) -> dict[str, Any]:
    """Return the parameters of the collision monitor: zones around scans, and people's polygons.

    The zones are sized as those of a safety scanner: from 0.45 m/s, 30 % of the maximum, the robot
    stops in 0.1 m; from 1.5 m/s it comes down to that in 1.0 m.
    """
    zones: dict[str, Any] = {
        "ScanStop": {
            "type": "polygon",
            "points": "[[0.61, 0.30], [0.61, -0.30], [-0.36, -0.30], [-0.36, 0.30]]",
            "action_type": "stop",
            "min_points": 4,
            "sources_names": list(_SCANS),
            "enabled": True,
        },
        "ScanSlow": {
            "type": "polygon",
            "points": "[[1.66, 0.40], [1.66, -0.40], [-0.36, -0.40], [-0.36, 0.40]]",
            "action_type": "slowdown",
            "slowdown_ratio": 0.3,
            "min_points": 4,
            "sources_names": list(_SCANS),
            "enabled": True,
        },
    }
    sources: dict[str, Any] = {
        name: {"type": "scan", "topic": f"/{name}", "enabled": True} for name in _SCANS
    }
    if people:
        zones["StopZone"] = {
            "type": "polygon",
            "action_type": "stop",
            "min_points": 4,
            "polygon_sub_topic": "/awarenav/stop_zone",
            "sources_names": ["people"],
            "enabled": True,
        }
        sources["people"] = {
            "type": "polygon",
            "topic": "/awarenav/collision_polygons",
            "sampling_distance": 0.1,
            "enabled": True,
        }
    return {
        "base_frame_id": "base_link",
        "odom_frame_id": "odom",
        "cmd_vel_in_topic": "cmd_vel_smoothed",
        "cmd_vel_out_topic": "cmd_vel",
        "state_topic": "collision_monitor_state",
        "transform_tolerance": 0.3,
        "source_timeout": 0.5,
        "base_shift_correction": True,
        "stop_pub_timeout": 2.0,
        "polygons": list(zones),
        "observation_sources": list(sources),
        **zones,
        **sources,
    }
