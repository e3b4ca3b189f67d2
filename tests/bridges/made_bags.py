"""Recordings of ROS 2 for tests."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags import rosbag2
from rosbags.typesys import Stores, get_typestore

START = 1_700_000_000_000_000_000


def made(path: Path, kind: str = "mcap", count: int = 50) -> Path:
    """A robot that drives along x at 1 m/s: odometry each 100 ms, a position each 500 ms."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    header, stamp = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    plugin = rosbag2.StoragePlugin.MCAP if kind == "mcap" else rosbag2.StoragePlugin.SQLITE3
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        speed = writer.add_connection("/robot/twist", "geometry_msgs/msg/TwistStamped", typestore=store)
        place = writer.add_connection("/robot/gps", "geometry_msgs/msg/PointStamped", typestore=store)
        cloud = writer.add_connection("/robot/numbers", "std_msgs/msg/Float64MultiArray", typestore=store)
        vector, twist = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Twist"]
        for number in range(count):
            time = START + number * 100_000_000
            head = header(stamp(time // 10**9, time % 10**9), "base_link")
            moving = types["geometry_msgs/msg/TwistStamped"](head, twist(vector(1.0, 0.0, 0.0), vector(0.0, 0.0, 0.0)))
            writer.write(speed, time, store.serialize_cdr(moving, "geometry_msgs/msg/TwistStamped"))
            if number % 5 == 0:
                point = types["geometry_msgs/msg/Point"](number * 0.1, 0.0, 0.0)
                at = types["geometry_msgs/msg/PointStamped"](header(head.stamp, "map"), point)
                writer.write(place, time, store.serialize_cdr(at, "geometry_msgs/msg/PointStamped"))
        layout = types["std_msgs/msg/MultiArrayLayout"]([], 0)
        numbers = types["std_msgs/msg/Float64MultiArray"](layout, np.array([1.0, 2.0]))
        writer.write(cloud, time + 1, store.serialize_cdr(numbers, "std_msgs/msg/Float64MultiArray"))
    return path
