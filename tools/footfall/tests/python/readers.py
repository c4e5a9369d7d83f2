"""What programs in Python read: a capture, its robot, and a run that is served. Prints one JSON object."""

import base64
import json
import sys

from mcap.reader import make_reader


def text_of(data):
    """The text of a message `std_msgs/msg/String`: four bytes of encapsulation, length, text, zero."""
    length = int.from_bytes(data[4:8], "little")
    return data[8 : 8 + length - 1].decode()


def robot(urdf, folder):
    """Joints of the robot, and where a foot is when the left hip is bent by 90 degrees."""
    import yourdfpy

    path = folder + "/robot.urdf"
    with open(path, "w") as file:
        file.write(urdf)
    model = yourdfpy.URDF.load(path)
    model.update_cfg({"set_left_hip": 1.5707963267948966})
    shank = model.get_transform("left_shank", "pelvis")[:3, 3]
    return {"joints": model.actuated_joint_names, "shank_m": [round(float(x), 6) for x in shank]}


def capture(path, folder):
    """Compression, times, and both forms of the joint states of a capture."""
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        sensor = [
            [message.log_time, message.publish_time, json.loads(message.data)["tick"]]
            for _, _, message in reader.iter_messages(topics=["/sensor"])
        ]
        states = [json.loads(message.data) for _, _, message in reader.iter_messages(topics=["/foxglove_joint_states"])]
        urdf = [text_of(message.data) for _, _, message in reader.iter_messages(topics=["/robot_description"])]
    schema = next(schema for schema in summary.schemas.values() if schema.name == "foxglove.JointStates")
    return {
        "compression": sorted({chunk.compression for chunk in summary.chunk_indexes}),
        "sensor": sensor,
        "states": states,
        "schema": json.loads(schema.data),
        "robot": robot(urdf[0], folder),
        # The same message by Foxglove's own package: the names of the fields that it knows.
        "known": known_fields(states[0]),
    }


def known_fields(state):
    """Takes a message into the types of Foxglove's package, which refuse a field that they do not have."""
    from foxglove.messages import JointState, JointStates, Timestamp

    joints = [JointState(**joint) for joint in state["joints"]]
    whole = JointStates(timestamp=Timestamp(**state["timestamp"]), joints=joints)
    return len(whole.encode()) > 0


def live(address, go):
    """Subscribes to the joint states of a run, lets the board start, and receives until the server closes."""
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect

    messages = []
    with connect(address, subprotocols=["foxglove.sdk.v1"]) as socket:
        info, advertised = json.loads(socket.recv()), json.loads(socket.recv())
        topics = {channel["id"]: channel["topic"] for channel in advertised["channels"]}
        wanted = next(id for id, topic in topics.items() if topic == "/foxglove_joint_states")
        socket.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": wanted}]}))
        open(go, "w").close()
        try:
            while True:
                data = socket.recv(timeout=20)
                assert data[0] == 1 and int.from_bytes(data[1:5], "little") == 7, base64.b64encode(data)
                messages.append([int.from_bytes(data[5:13], "little"), json.loads(data[13:])])
        except ConnectionClosed:
            pass
    return {"server": info["name"], "messages": messages}


if __name__ == "__main__":
    what = {"capture": capture, "live": live}[sys.argv[1]]
    print(json.dumps(what(*sys.argv[2:])))
