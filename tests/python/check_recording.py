"""Opens a recording with the mcap reader: check_recording.py RECORDING CYCLES"""

import json
import sys

from mcap.reader import make_reader

recording, cycles = sys.argv[1], int(sys.argv[2])
EVERY_CYCLE = [
    "/joint_states", "/joint_goals", "/servos", "/feet", "/trunk", "/motion", "/buses", "/loop", "/tf",
]
FOXGLOVE = {
    "/scene": "foxglove.SceneUpdate",
    "/tf": "foxglove.FrameTransforms",
    "/trunk": "foxglove.PoseInFrame",
}

with open(recording, "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    summary = reader.get_summary()
    counts = {
        channel.topic: summary.statistics.channel_message_counts[channel.id]
        for channel in summary.channels.values()
    }
    for topic in EVERY_CYCLE:
        assert counts[topic] == cycles, (topic, counts[topic], cycles)
    last_time = -1
    for schema, channel, message in reader.iter_messages():
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json"), channel
        assert schema.name == FOXGLOVE.get(channel.topic, schema.name), (channel, schema.name)
        assert message.log_time >= last_time
        last_time = message.log_time
        fields = json.loads(message.data)
        required = json.loads(schema.data)["required"]
        assert set(required) <= set(fields), (channel.topic, required, list(fields))
    attachments = {attachment.name for attachment in reader.iter_attachments()}
    assert attachments == {"robot.toml", "run.json"}, attachments
    outcome = {record.name: record.metadata for record in reader.iter_metadata()}["outcome"]
    assert outcome["outcome"] == "completed", outcome
print(f"{sum(counts.values())} messages read")
