"""Other programs read the recordings of `toposlam record`: the mcap package, JSON Schema, protobuf and Rerun.

`TOPOSLAM=path/to/toposlam python3 -m unittest test_mcap`, with what requirements-mcap.txt names.
"""

from __future__ import annotations

import collections
import io
import json
import math
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

from frames import frame, varint
from requirement import require

REPOSITORY = Path(__file__).resolve().parents[2]
TOPOSLAM = os.environ.get("TOPOSLAM", str(REPOSITORY / "target" / "debug" / "toposlam"))
RERUN = Path(sys.executable).with_name("rerun")

FRAMES, RING, MAP = "/toposlam/frames", "/toposlam/ring", "/toposlam/map"
VERTICES, TRANSFORM = "/toposlam/vertices", "/toposlam/transform"
EVENTS, LOG = "/toposlam/events", "/toposlam/log"
SCHEMAS = {
    FRAMES: ("protobuf", "toposlam.Frame"),
    RING: ("protobuf", "foxglove.LaserScan"),
    MAP: ("protobuf", "foxglove.SceneUpdate"),
    VERTICES: ("protobuf", "foxglove.PosesInFrame"),
    TRANSFORM: ("protobuf", "foxglove.FrameTransform"),
    EVENTS: ("jsonschema", "toposlam.Event"),
    LOG: ("protobuf", "foxglove.Log"),
}
# Their type depends on the message, or they may be null: the schema leaves them out.
WITHOUT_TYPE = {"degree", "outcome", "vertices"}

missing = []
if not Path(TOPOSLAM).exists():
    missing.append(TOPOSLAM)
try:
    import jsonschema
    from mcap.exceptions import McapError
    from mcap.reader import make_reader
    from mcap.records import Chunk, Message
    from mcap.stream_reader import StreamReader, breakup_chunk
    from mcap_protobuf.decoder import DecoderFactory
except ImportError as error:
    missing.append(str(error.name))
if not RERUN.exists():
    missing.append(str(RERUN))


def setUpModule() -> None:
    require(missing, "the recordings were not read by other programs")


def run(*arguments: str) -> str:
    environment = {**os.environ, "RERUN_ANALYTICS": "0", "NO_COLOR": "1"}
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=120, env=environment, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{arguments}: {done.stdout}{done.stderr}")
    return done.stdout


def crafted() -> bytes:
    """An edge, a fault, a damaged frame, and a ring of 500 mm, silence and a dead sonar (docs/wire.md, Messages)."""
    damaged = bytearray(frame(2, bytes([8, 1, 1])))
    damaged[-3] ^= 0x80
    ring = bytes([10, 7, 3]) + varint(502) + bytes([1, 0])
    return frame(0, bytes([4, 0, 1, 1])) + frame(1, bytes([8, 0, 5])) + bytes(damaged) + frame(3, ring)


def record_crafted(file: Path) -> None:
    """Is a robot that says what `crafted` gives and goes away."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        def speak() -> None:
            with server.accept()[0] as line:
                line.sendall(crafted())

        thread = threading.Thread(target=speak, daemon=True)
        thread.start()
        run(TOPOSLAM, "record", f"tcp:127.0.0.1:{server.getsockname()[1]}", str(file))
        thread.join()


def record_robot(file: Path) -> None:
    command = [TOPOSLAM, "robot", "--listen", "127.0.0.1:0", "--plan", "flat", "--speed", "50"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as robot:
        try:
            line = robot.stdout.readline().split()[-1]
            run(TOPOSLAM, "record", line, str(file), "--places", "8")
        finally:
            robot.kill()


def decoded(data: bytes, topic: str) -> list:
    reader = make_reader(io.BytesIO(data), validate_crcs=True, decoder_factories=[DecoderFactory()])
    return [found.decoded_message for found in reader.iter_decoded_messages(topics=[topic])]


def payloads(reader, topic: str):
    return (message.data for _, _, message in reader.iter_messages(topics=[topic]))


class Recordings(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(directory.cleanup)
        cls.folder = Path(directory.name)
        cls.robot_file = cls.folder / "robot.mcap"
        cls.crafted_file = cls.folder / "crafted.mcap"
        record_robot(cls.robot_file)
        record_crafted(cls.crafted_file)
        cls.robot = cls.robot_file.read_bytes()
        cls.crafted = cls.crafted_file.read_bytes()

    def test_every_topic_has_its_schema_and_as_many_messages_as_the_index_says(self) -> None:
        for data in (self.robot, self.crafted):
            reader = make_reader(io.BytesIO(data), validate_crcs=True)
            summary = reader.get_summary()
            schemas = {
                channel.topic: (summary.schemas[channel.schema_id].encoding, summary.schemas[channel.schema_id].name)
                for channel in summary.channels.values()
            }
            self.assertEqual(schemas, SCHEMAS)
            counted = collections.Counter(channel.id for _, channel, _ in reader.iter_messages())
            said = summary.statistics.channel_message_counts
            self.assertEqual(dict(counted), {channel: count for channel, count in said.items() if count})
            self.assertGreater(sum(counted.values()), 4)

    def test_the_frames_are_the_bytes_of_the_line_damage_included(self) -> None:
        self.assertEqual(b"".join(frame.data for frame in decoded(self.crafted, FRAMES)), crafted())

    def test_every_event_fits_its_schema_and_has_no_field_that_it_does_not_name(self) -> None:
        names = set()
        for data in (self.robot, self.crafted):
            reader = make_reader(io.BytesIO(data))
            schemas = reader.get_summary().schemas.values()
            schema = json.loads(next(schema.data for schema in schemas if schema.name == "toposlam.Event"))
            jsonschema.Draft7Validator.check_schema(schema)
            validator = jsonschema.Draft7Validator(schema)
            for payload in payloads(reader, EVENTS):
                event = json.loads(payload)
                validator.validate(event)
                self.assertLessEqual(set(event), set(schema["properties"]) | WITHOUT_TYPE, event)
                names.add(event["event"])
            self.assertFalse(validator.is_valid({"event": 7}))
        self.assertLessEqual({"Hello", "Place", "Belief", "Velocity", "Edge", "Fault", "Damaged"}, names)

    def test_the_schema_of_events_has_one_plain_type_for_each_field_as_foxglove_wants(self) -> None:
        def check(schema: dict) -> None:
            self.assertIn(schema["type"], ("object", "array", "string", "integer", "number", "boolean"))
            for part in schema.get("properties", {}).values():
                check(part)
            if schema["type"] == "array":
                check(schema["items"])

        schemas = make_reader(io.BytesIO(self.robot)).get_summary().schemas.values()
        check(json.loads(next(schema.data for schema in schemas if schema.name == "toposlam.Event")))

    def test_the_last_scene_is_the_map_that_play_prints(self) -> None:
        printed = run(TOPOSLAM, "play", str(self.robot_file))
        vertices, edges = map(int, re.search(r"map: (\d+) vertices, (\d+) edges", printed).groups())
        radii = re.findall(r"vertex +(\d+): radius +(\d+) mm", printed)
        at = int(re.search(r"at vertex (\d+)", printed).group(1))
        entity = decoded(self.robot, MAP)[-1].entities[0]
        self.assertEqual((len(entity.cylinders), len(radii)), (vertices, vertices))
        self.assertEqual([text.text for text in entity.texts], [f"{vertex}: {radius} mm" for vertex, radius in radii])
        for disc, (_, radius) in zip(entity.cylinders, radii, strict=True):
            self.assertAlmostEqual(disc.size.x, 2 * int(radius) / 1000)
        # Frontiers are stubs of another colour. Loops and parallel edges have bends, so that an edge can have several segments.
        lines = [line for line in entity.lines if line.color.r == line.color.g]
        straight = sum(len(line.points) // 2 for line in lines if line.type == 2)
        self.assertGreaterEqual(straight + sum(line.type == 1 for line in lines), edges)
        colours = [(disc.color.r, disc.color.g, disc.color.b) for disc in entity.cylinders]
        self.assertEqual([colours.count(colour) == 1 for colour in colours].index(True), at)
        poses = decoded(self.robot, VERTICES)[-1].poses
        robot = decoded(self.robot, TRANSFORM)[-1]
        self.assertEqual((robot.parent_frame_id, robot.child_frame_id), (entity.frame_id, "robot"))
        self.assertEqual((robot.translation.x, robot.translation.y), (poses[at].position.x, poses[at].position.y))

    def test_a_ring_is_in_metres_with_silence_infinite_and_a_dead_sonar_not_a_number(self) -> None:
        (scan,) = decoded(self.crafted, RING)
        self.assertEqual(list(scan.ranges)[:2], [0.5, math.inf])
        self.assertTrue(math.isnan(scan.ranges[2]))
        self.assertAlmostEqual(scan.end_angle - scan.start_angle, 2 * math.pi * 2 / 3)
        self.assertEqual([log.message for log in decoded(self.crafted, LOG)], ["SonarSilent: 5 so far"])

    def test_a_file_that_was_cut_gives_its_whole_chunks(self) -> None:
        chunks = make_reader(io.BytesIO(self.robot)).get_summary().chunk_indexes
        self.assertGreater(len(chunks), 1)
        cut = StreamReader(io.BytesIO(self.robot[: chunks[1].chunk_start_offset + 100]), emit_chunks=True)
        read = []
        with self.assertRaises(McapError):
            for record in cut.records:
                if isinstance(record, Chunk):
                    read += [part.data for part in breakup_chunk(record, validate_crc=True) if isinstance(part, Message)]
        every = [message.data for _, _, message in make_reader(io.BytesIO(self.robot)).iter_messages()]
        self.assertGreater(len(read), 0)
        self.assertEqual(read, every[: len(read)])

    def test_rerun_finds_no_fault_and_decodes_positions_transforms_and_logs(self) -> None:
        for file, archetypes in (
            (self.robot_file, ("InstancePoses3D:translations", "Transform3D:translation")),
            (self.crafted_file, ("TextLog:text", "foxglove.LaserScan:message", "foxglove.SceneUpdate:message")),
        ):
            self.assertIn("/toposlam/frames", run(str(RERUN), "mcap", "check", str(file)))
            converted = str(file.with_suffix(".rrd"))
            run(str(RERUN), "mcap", "convert", str(file), "-o", converted)
            statistics = run(str(RERUN), "rrd", "stats", converted)
            for archetype in archetypes:
                self.assertIn(archetype, statistics)


if __name__ == "__main__":
    unittest.main()
