"""Checks the decoder against the golden file of the Rust library: `python -m unittest discover python/tests`."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import os
import random
import re
import socket
import subprocess
import sys
import tempfile
import threading
import unittest
import zlib
from pathlib import Path
from typing import Any, Callable, Optional

PYTHON = Path(__file__).resolve().parent.parent
REPOSITORY = PYTHON.parent
sys.path.insert(0, str(PYTHON))

import toposlam_stream
from toposlam_stream import (
    Arrival,
    Client,
    Command,
    Counters,
    Damaged,
    DecodeError,
    Decoder,
    Edge,
    Encoder,
    Exploration,
    Received,
    Hello,
    GoalStatus,
    GoalState,
    Line,
    Map,
    NoReply,
    Outcome,
    MapReplica,
    Refusal,
    Reply,
    Request,
    Ring,
    Setting,
    Way,
    WayId,
    Ways,
    json_line,
    open_line,
    to_json,
)

RECORDS = [json.loads(line) for line in (REPOSITORY / "host-tests/golden/stream.jsonl").read_text().splitlines()]


def of_kind(kind: str) -> list[dict[str, Any]]:
    return [record for record in RECORDS if record["kind"] == kind]


def exploration() -> bytes:
    return bytes.fromhex(next(record["bytes"] for record in RECORDS if record.get("name") == "an exploration"))


def feed_in_pieces(stream: bytes, piece_bytes: int) -> tuple[list[Any], Decoder]:
    decoder = Decoder()
    pieces = (stream[at : at + piece_bytes] for at in range(0, len(stream), piece_bytes))
    return [event for piece in pieces for event in decoder.feed(piece)], decoder


def replica_json(replica: MapReplica) -> dict[str, Any]:
    named = ("hello", "location", "evidence", "health", "belief", "worst", "goal_status", "exploration")
    return {
        "vertices": replica.vertices,
        "rows": [plain(replica.row(vertex)) for vertex in range(replica.vertices)],
        "edges": [list(edge) for edge in replica.edges()],
        "ways": [[plain(way) for way in replica.ways(vertex)] for vertex in range(replica.vertices)],
        "frontiers": [plain(way) for way in replica.frontiers()],
        "is_converged": replica.is_converged(),
        "is_complete": replica.is_complete(),
        "names": [[vertex, name] for vertex, name in sorted(replica.names.items())],
        "faults": list(replica.faults.values()),
        **{name: plain(getattr(replica, name)) for name in named},
    }


def plain(message: Any) -> Any:
    if message is None:
        return None
    event = to_json(Received(0, Arrival.FIRST, 0, message))
    return {name: value for name, value in event.items() if name not in ("event", "sequence")}


def needs(what: str, is_there: bool) -> Callable[[Any], Any]:
    """Skips a test with a message if a requirement is missing; fails it in CI."""
    if is_there:
        return lambda test: test
    print(f"SKIPPED: {what} is missing", file=sys.stderr)
    if os.environ.get("CI") == "true":
        return lambda test: lambda self: self.fail(f"{what} is missing")
    return unittest.skip(f"{what} is missing")


class Golden(unittest.TestCase):
    def test_every_message_decodes_and_encodes_like_the_library(self) -> None:
        for record in of_kind("message"):
            with self.subTest(record["event"]["event"], frame=record["frame"]):
                frame = bytes.fromhex(record["frame"])
                (event,) = Decoder().feed(frame)
                self.assertEqual(to_json(event), record["event"])
                self.assertEqual(Encoder(event.sequence).encode(event.message), frame)

    def test_every_request_encodes_like_the_library(self) -> None:
        for record in of_kind("request"):
            with self.subTest(request=record["request"]):
                frame = bytes.fromhex(record["frame"])
                (event,) = Decoder(requests=True).feed(frame)
                self.assertEqual(plain(event.message), record["request"])
                self.assertEqual(Encoder(record["sequence"]).encode(event.message), frame)

    def test_the_golden_file_covers_every_message_outcome_command_and_setting(self) -> None:
        messages = {record["event"]["event"] for record in of_kind("message")}
        self.assertEqual(messages, {of.__name__ for of in toposlam_stream.Message.__args__})

        def names(values: Any) -> set[str]:
            return {value if isinstance(value, str) else next(iter(value)) for value in values}

        outcomes = names(record["event"]["outcome"] for record in of_kind("message") if record["event"]["event"] == "Reply")
        self.assertEqual(outcomes, {of.__name__ for of in toposlam_stream.AnyOutcome.__args__})
        commands = [record["request"]["command"] for record in of_kind("request")]
        self.assertEqual(names(commands), {of.__name__ for of in toposlam_stream.AnyCommand.__args__})
        settings = {next(iter(command["SetConfig"])) for command in commands if "SetConfig" in command}
        self.assertEqual(len(settings), len(Setting))

    def test_every_stream_gives_the_events_counts_and_map_of_the_library(self) -> None:
        for record in of_kind("stream"):
            with self.subTest(record["name"]):
                decoder, replica = Decoder(), MapReplica()
                lines, converged = [], 0
                events = decoder.feed(bytes.fromhex(record["bytes"]))
                for event in events:
                    replica.apply(event)
                    converged += replica.is_converged()
                    lines.append(json_line(to_json(event)) + "\n")
                self.assertEqual(dataclasses.asdict(decoder.counters), record["counters"])
                self.assertEqual(len(events), record["events"])
                self.assertEqual(zlib.crc32("".join(lines).encode()), record["events_crc32"])
                self.assertEqual(converged, record["converged"])
                self.assertEqual(replica_json(replica), record["replica"])

    def test_decoding_is_independent_of_the_split_points(self) -> None:
        for record in of_kind("stream"):
            stream = bytes.fromhex(record["bytes"])
            whole, decoder = feed_in_pieces(stream, len(stream))
            for piece_bytes in (1, 7, 113):
                with self.subTest(record["name"], piece_bytes=piece_bytes):
                    events, in_pieces = feed_in_pieces(stream, piece_bytes)
                    self.assertEqual(events, whole)
                    self.assertEqual(in_pieces.counters, decoder.counters)

    def test_the_examples_and_versions_match_the_specification(self) -> None:
        specification = (REPOSITORY / "docs/wire.md").read_text()
        for version in (toposlam_stream.PROTOCOL_VERSION, toposlam_stream.FRAME_VERSION):
            self.assertIn(f"version is {version}", specification)
        self.assertIn(f"{toposlam_stream.SCHEMA_HASH:016X}", specification)
        for kind, requests, count in (("example", False, 27), ("request", True, 22)):
            blocks = re.findall(rf"```{kind}\n(.*?)```", specification, re.DOTALL)
            self.assertEqual(len(blocks), count)
            for block in blocks:
                frame = bytes.fromhex(re.search("frame: (.*)", block)[1])
                (event,) = Decoder(requests).feed(frame)
                self.assertIn(f"sequence: {event.sequence}\n", block)
                self.assertEqual(Encoder(event.sequence).encode(event.message), frame)


class Restarts(unittest.TestCase):
    """A number that is higher by chance looks like lost frames; the session id and the clocks show the restart."""

    HELLO = next(event.message for event in Decoder().feed(exploration()) if isinstance(event.message, Hello))

    def replica(self, *frames: bytes, reopens: bool = False) -> MapReplica:
        decoder, replica = Decoder(), MapReplica()
        encoder = Encoder()
        before = [self.HELLO, Edge(0, 1, True), GoalStatus(1, GoalState.ACTIVE), Ring(900, ())]
        for event in decoder.feed(b"".join(map(encoder.encode, before))):
            replica.apply(event)
        self.assertEqual((replica.edges(), replica.vertices), ([(0, 1)], 2))
        if reopens:
            decoder.reconnected()
        for event in decoder.feed(b"".join(frames)):
            replica.apply(event)
        self.assertEqual(decoder.counters.restarts, 1)
        return replica

    def test_no_state_of_the_session_before_is_left(self) -> None:
        hello = dataclasses.replace(self.HELLO, session=self.HELLO.session ^ 1)
        late = Encoder(2).encode(Edge(4, 5, True))
        restarts = {
            "session": [Encoder(500).encode(hello)],
            "clock": [Encoder(500).encode(Ring(30, ())), Encoder(501).encode(hello)],
            "late": [late, Encoder(3).encode(hello)],
        }
        for name, frames in restarts.items():
            with self.subTest(name):
                replica = self.replica(*frames, reopens=name == "late")
                self.assertEqual((replica.hello, replica.goal_status), (hello, None))
                self.assertFalse((0, 1) in replica.edges())


class WaysOfAMap(unittest.TestCase):
    def test_loops_parallel_edges_and_frontiers_are_distinguished(self) -> None:
        def way(bearing_mrad: int, end: Optional[tuple[int, int]], travel_frames: Optional[int] = None) -> Way:
            return Way(bearing_mrad, WayId(*end) if end else None, travel_frames)

        hall = Ways(0, (way(0, (1, 1), 54), way(1500, (1, 0)), way(3000, (0, 3)), way(4000, (0, 2)), way(5000, None)))
        corner = Ways(1, (way(100, (0, 1)), way(1600, (0, 0), 54)))
        encoder, decoder, replica = Encoder(), Decoder(), MapReplica()
        for message in (hall, corner, Exploration(1, False)):
            for event in decoder.feed(encoder.encode(message)):
                replica.apply(event)
        ends = [((one.vertex, one.way), (other.vertex, other.way)) for one, other in replica.way_edges()]
        self.assertEqual(ends, [((0, 0), (1, 1)), ((0, 1), (1, 0)), ((0, 2), (0, 3))])
        self.assertEqual(replica.frontiers(), [WayId(0, 4)])
        self.assertEqual(replica.ways(0)[0].travel_frames, 54)
        self.assertEqual(replica.exploration, Exploration(1, False))
        with self.assertRaises(ValueError):
            Ways(0, (way(5, (0, 0)),))


class Robustness(unittest.TestCase):
    def test_arbitrary_bytes_never_raise(self) -> None:
        draw = random.Random(1)
        intact = exploration()
        for _ in range(300):
            noise = draw.randbytes(draw.randrange(400))
            at = draw.randrange(len(intact) - 600)
            stream = bytearray(intact[at : at + 600])
            for _ in range(draw.randrange(20)):
                stream[draw.randrange(len(stream))] = draw.choice((0, 1, 2, 127, 128, 255))
            decoder, replica = Decoder(), MapReplica()
            for event in decoder.feed(noise + bytes(stream)):
                replica.apply(event)
                json_line(to_json(event))
            self.assertLessEqual(replica.vertices, 64)

    def test_an_intact_frame_of_any_payload_is_one_message_or_one_error(self) -> None:
        draw = random.Random(2)
        for version, head, requests in ((2, b"", False), (130, b"\7", True), (130, b"\7\7", True)):
            received = []
            for _ in range(3000):
                rest = bytes(draw.choice((0, 1, 2, 127, 128, 255)) for _ in range(draw.randrange(30)))
                body = bytes([version, 0, 0]) + head + bytes([draw.randrange(20)]) + rest
                raw = body + zlib.crc32(body).to_bytes(4, "little")
                frame = b"".join(bytes([len(block) + 1]) + block for block in raw.split(b"\0")) + b"\0"
                (event,) = Decoder(requests).feed(frame)
                received.append(type(event))
            self.assertEqual(set(received), {Received, Damaged})

    def test_an_endless_frame_is_not_buffered(self) -> None:
        decoder = Decoder()
        for _ in range(100):
            self.assertEqual(decoder.feed(b"\xff" * 10_000), [])
            self.assertLess(len(decoder._begun), 200)
        self.assertEqual(decoder.feed(b"\0"), [Damaged(DecodeError.TOO_LONG)])

    def test_counters_saturate(self) -> None:
        decoder = Decoder()
        decoder.counters.cut = 0xFFFF_FFFF
        decoder.feed(b"\1\0")
        self.assertEqual(decoder.counters, Counters(cut=0xFFFF_FFFF))

    def test_out_of_range_values_are_not_encoded_and_use_no_sequence_number(self) -> None:
        encoder = Encoder()
        for command in (
            Command.GoTo(256),
            Command.GoTo(-1),
            Command.SetConfig(Setting.NOISE_MM, 65_536),
            Command.RestoreChunk(0, bytes(65)),
        ):
            with self.subTest(command), self.assertRaises(ValueError):
                encoder.encode(Request(1, command))
        with self.assertRaises(TypeError):
            encoder.encode(Request(1, Outcome.Done()))
        self.assertEqual(encoder.encode(Request(1, Command.Info())), Encoder(0).encode(Request(1, Command.Info())))


class Understanding(unittest.TestCase):
    def test_a_robot_with_another_version_or_schema_is_reported(self) -> None:
        hello = next(event.message for event in Decoder().feed(exploration()) if isinstance(event.message, Hello))
        self.assertIsNone(hello.complaint())
        newer = dataclasses.replace(hello, protocol_version=hello.protocol_version + 1, schema_hash=7)
        ours = toposlam_stream.PROTOCOL_VERSION
        self.assertIn(f"version {ours + 1}, this program {ours}", newer.complaint())
        other = dataclasses.replace(hello, schema_hash=7)
        self.assertIn("not understood", other.complaint())
        self.assertIn("0x0000000000000007", other.complaint())


class Listeners:
    """A TCP server that serves its first client."""

    def __init__(self, serve: Callable[[socket.socket], None]) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.name = f"tcp:127.0.0.1:{self._server.getsockname()[1]}"
        self._thread = threading.Thread(target=self._run, args=(serve,), daemon=True)
        self._thread.start()

    def _run(self, serve: Callable[[socket.socket], None]) -> None:
        connection, _ = self._server.accept()
        with connection:
            serve(connection)

    def __enter__(self) -> Listeners:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.close()
        self._thread.join(timeout=10)


def script(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(PYTHON)}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, timeout=120, check=False
    )


class Lines(unittest.TestCase):
    def test_the_command_prints_every_event_and_then_the_counts(self) -> None:
        record = of_kind("stream")[1]
        with Listeners(lambda connection: connection.sendall(bytes.fromhex(record["bytes"]))) as robot:
            printed = script("-m", "toposlam_stream", robot.name)
        self.assertEqual(printed.returncode, 0, printed.stderr)
        self.assertEqual(zlib.crc32(printed.stdout.encode()), record["events_crc32"])
        self.assertEqual(json.loads(printed.stderr), record["counters"])

    def test_a_file_of_raw_bytes_is_a_read_only_line_with_an_end(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            file = Path(directory, "received")
            file.write_bytes(exploration())
            received = b""
            with open_line(str(file)) as line:
                with self.assertRaises(OSError):
                    line.write(b"x")
                with self.assertRaises(EOFError):
                    while True:
                        received += line.read()
        self.assertEqual(received, exploration())

    def test_a_line_that_cannot_be_opened_prints_an_error_without_a_traceback(self) -> None:
        for name in ("tcp:127.0.0.1", "tcp:127.0.0.1:1", "/no/such/port"):
            with self.subTest(name):
                printed = script("-m", "toposlam_stream", name)
                self.assertEqual(printed.returncode, 1)
                self.assertIn("toposlam_stream: ", printed.stderr)
                self.assertNotIn("Traceback", printed.stderr)

    def test_a_missing_pyserial_is_reported_with_the_install_command(self) -> None:
        hidden = sys.modules.get("serial")
        sys.modules["serial"] = None  # type: ignore[assignment]
        try:
            with self.assertRaisesRegex(ImportError, "pip install pyserial"):
                open_line("/dev/ttyACM0")
        finally:
            del sys.modules["serial"]
            if hidden is not None:
                sys.modules["serial"] = hidden

    @needs("pyserial", importlib.util.find_spec("serial") is not None and hasattr(os, "openpty"))
    def test_a_serial_port_is_read_and_written(self) -> None:
        robot, port = os.openpty()
        with open_line(os.ttyname(port)) as line:
            self.assertEqual(line.read(), b"")
            os.write(robot, b"abc\0")
            received = b""
            while len(received) < 4:
                received += line.read()
            self.assertEqual(received, b"abc\0")
            line.write(b"\1\2")
            self.assertEqual(os.read(robot, 2), b"\1\2")
        os.close(robot)
        os.close(port)


class Commanding(unittest.TestCase):
    def test_a_request_is_repeated_until_its_reply(self) -> None:
        ear, mouth = Decoder(requests=True), Encoder()
        to_client = [b"noise"]
        asked = []

        def answer(data: bytes) -> None:
            for event in ear.feed(data):
                asked.append(event.message)
                to_client.append(mouth.encode(Reply(event.message.id ^ 1, Outcome.Done())))
                to_client.append(mouth.encode(GoalStatus(3, GoalState.ACTIVE)))
                if len(asked) > 1:
                    to_client.append(b"\0" + mouth.encode(Reply(event.message.id, Outcome.Refused(Refusal.NO_ROUTE))))

        received = []
        client = Client(Line(lambda: to_client.pop(0) if to_client else b"", answer, lambda: None), received.append)
        client.timeout_s = 0.05
        self.assertEqual(client.request(Command.GoTo(3)), Outcome.Refused(Refusal.NO_ROUTE))
        self.assertEqual(len(asked), 2)
        self.assertEqual(asked[0], asked[1], "the repeated request is identical, so that it is executed once")
        self.assertEqual(client.replica.goal_status, GoalStatus(3, GoalState.ACTIVE))
        self.assertTrue(any(isinstance(event, Damaged) for event in received))
        client.request(Command.Explore())
        self.assertNotEqual(asked[2].id, asked[0].id)

    def test_a_silent_robot_times_out(self) -> None:
        sent = []
        client = Client(Line(lambda: b"", sent.append, lambda: None))
        client.timeout_s, client.attempts = 0.01, 3
        with self.assertRaises(NoReply):
            client.request(Command.Info())
        self.assertEqual(len(sent), 3)

    def toposlam(self) -> Optional[Path]:
        if "TOPOSLAM" in os.environ:
            return Path(os.environ["TOPOSLAM"])
        target = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))
        built = [target / profile / "toposlam" for profile in ("release", "debug")]
        return next((path for path in built if path.is_file()), None)

    def test_a_simulated_robot_executes_commands(self) -> None:
        toposlam = self.toposlam()
        if toposlam is None:
            print("SKIPPED: the command toposlam is not built", file=sys.stderr)
            self.assertNotEqual(os.environ.get("CI"), "true", "cargo build first")
            self.skipTest("the command toposlam is not built")
        arguments = [str(toposlam), "robot", "--listen", "127.0.0.1:0", "--speed", "30"]
        with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True) as robot:
            try:
                name = robot.stdout.readline().split()[-1]
                with open_line(name) as line:
                    client = Client(line)
                    info = client.request(Command.Info())
                    self.assertIsInstance(info, Outcome.Info)
                    self.assertEqual(client.request(Command.GoTo(200)), Outcome.Refused(Refusal.UNKNOWN_VERTEX))
                    self.assertEqual(client.request(Command.Pause(True)), Outcome.Done())
                    self.assertEqual(client.request(Command.SetConfig(Setting.NOISE_MM, 40)), Outcome.Done())
                    self.assertEqual(client.request(Command.GetMap()), Outcome.Done())
                    while not client.replica.is_converged():
                        client.listen()
                    self.assertIsNone(client.replica.hello.complaint())
                    self.assertTrue(client.request(Command.Info()).paused)
                    self.assertEqual(client.decoder.counters.unknown_message, 0)
            finally:
                robot.kill()


class Example(unittest.TestCase):
    @needs("matplotlib", importlib.util.find_spec("matplotlib") is not None)
    def test_the_map_of_a_recording_is_plotted(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            recording, picture = Path(directory, "received"), Path(directory, "map.png")
            recording.write_bytes(exploration())
            printed = script(str(PYTHON / "examples/plot_map.py"), str(recording), "--save", str(picture))
            self.assertEqual(printed.returncode, 0, printed.stderr)
            self.assertEqual(picture.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")
            blank = Path(directory, "blank.png")
            recording.write_bytes(Encoder().encode(Map(0, 0, 0)))
            script(str(PYTHON / "examples/plot_map.py"), str(recording), "--save", str(blank))
            self.assertGreater(picture.stat().st_size, blank.stat().st_size + 5000, "something is drawn")

    @needs("matplotlib", importlib.util.find_spec("matplotlib") is not None)
    def test_an_endless_stream_is_plotted_after_the_time_limit(self) -> None:
        def talk(connection: socket.socket) -> None:
            try:
                while True:
                    connection.sendall(exploration())
            except OSError:
                pass

        with tempfile.TemporaryDirectory() as directory, Listeners(talk) as robot:
            picture = Path(directory, "map.png")
            printed = script(str(PYTHON / "examples/plot_map.py"), robot.name, "--save", str(picture), "--seconds", "0.5")
            self.assertEqual(printed.returncode, 0, printed.stderr)
            self.assertTrue(picture.is_file())

    def test_the_rate_of_decoding_is_measured(self) -> None:
        with tempfile.TemporaryDirectory() as directory:
            recording = Path(directory, "received")
            recording.write_bytes(exploration())
            printed = script(str(PYTHON / "examples/decode_rate.py"), str(recording))
        self.assertRegex(printed.stdout, r"MB/s, \d+ frames/s\n")


if __name__ == "__main__":
    unittest.main()
