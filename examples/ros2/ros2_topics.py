"""Writes the ROS 2 topics of a capture to a file of their own: `python ros2_topics.py walk.mcap ros2.mcap`; needs `mcap`."""

import sys
from mcap.reader import make_reader
from mcap.writer import Writer

with open(sys.argv[1], "rb") as source, open(sys.argv[2], "wb") as target:
    writer, channels = Writer(target), {}
    writer.start(profile="ros2", library="footfall")
    for schema, channel, message in make_reader(source).iter_messages():
        if channel.message_encoding == "cdr":
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", number)
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.publish_time)
    writer.finish()
