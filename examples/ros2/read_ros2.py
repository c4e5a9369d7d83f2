"""Prints the joint states of a file of ROS 2: `python read_ros2.py ros2.mcap`; needs `rosbags`."""

import sys
from pathlib import Path
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

with AnyReader([Path(sys.argv[1])], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
    states = [connection for connection in reader.connections if connection.topic == "/joint_states"]
    for connection, time_ns, raw in reader.messages(connections=states):
        state = reader.deserialize(raw, connection.msgtype)
        print(time_ns, *state.name, *state.position)
