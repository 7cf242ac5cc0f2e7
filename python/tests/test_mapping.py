"""Holds the Python module to the Rust library: `TOPOSLAM=target/debug/toposlam python -m unittest discover python/tests`.

The same input gives the same map, bit for bit, as `host-tests/examples/map_lines.rs` and `toposlam replay`. `cargo test` builds both.
"""

from __future__ import annotations

import csv
import io
import math
import os
import random
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, Callable, Union

import toposlam
from toposlam import Exit, Mapper, OrderedConfig, PaperConfig, PlaceConfig, PlaceDetector, RobustConfig, ring_frame

PYTHON = Path(__file__).resolve().parent.parent
REPOSITORY = PYTHON.parent
sys.path.insert(0, str(PYTHON))

from toposlam_stream import Decoder, Received, Ring  # noqa: E402

Config = Union[OrderedConfig, RobustConfig, PaperConfig]
Frame = list[Union[int, str]]

TOPOSLAM = Path(os.environ.get("TOPOSLAM", REPOSITORY / "target/debug/toposlam"))
MAP_LINES = TOPOSLAM.parent / "examples/map_lines"
CONFIGS: dict[str, Config] = {"ordered": OrderedConfig(), "robust": RobustConfig(), "paper": PaperConfig()}
FILTERS: dict[str, Callable[..., toposlam.Filter]] = {
    "ordered": toposlam.OrderedFilter,
    "robust": toposlam.RobustFilter,
    "paper": toposlam.PaperFilter,
}


def run(program: Path, *arguments: object, lines: str = "") -> str:
    """The standard output of a program of the library."""
    if not program.exists():
        assert "CI" not in os.environ, f"{program} is missing: cargo test builds it"
        raise unittest.SkipTest(f"{program} is missing: cargo test builds it")
    command = [str(program), *map(str, arguments)]
    return subprocess.run(command, input=lines, capture_output=True, text=True, check=True).stdout


def office() -> list[Frame]:
    """The ring frames of a recorded robot in an office."""
    events = Decoder().feed((REPOSITORY / "examples/office.bin").read_bytes())
    messages = (event.message for event in events if isinstance(event, Received))
    return [list(message.ranges_mm) for message in messages if isinstance(message, Ring)]


def corridor(sonars: int, seed: int) -> list[Frame]:
    """To and fro between the ends of corridors of several widths, with noise, missed echoes and a dead sensor now and then."""
    draw = random.Random(seed)
    frames = []
    for half_mm in [draw.choice([700, 900, 1200]) for _ in range(12)]:
        for step in range(-40, 41):
            ahead_mm = half_mm + 30 * abs(step)
            frame: Frame = ["silence"] * sonars
            for sensor in range(sonars):
                bearing = 2 * math.pi * sensor / sonars
                side_mm = half_mm / max(abs(math.sin(bearing)), 1e-9)
                front_mm = ahead_mm / max(math.cos(bearing), 1e-9)
                frame[sensor] = round(min(side_mm, front_mm, 9000) + draw.gauss(0, 8))
                if draw.random() < 0.02:
                    frame[sensor] = draw.choice(["silence", "dead"])
            frames.append(frame)
    return frames


def text(value: object) -> str:
    return "" if value is None else str(value)


class SameMapAsTheLibrary(unittest.TestCase):
    def check_frames(self, name: str, sonars: int, seed: int, frames: list[Frame]) -> int:
        draw = random.Random(seed)
        mapper = Mapper(sonars, CONFIGS[name], seed=seed)
        lines, found = [], []
        for number, frame in enumerate(frames):
            exit_mrad = draw.choice([None, 0, 1571, 3142])
            travel_frames = draw.choice([None, 1 + number % 90])
            entry_mrad = draw.choice([None, 3142, -1500])
            lines.append(",".join([" ".join(map(str, frame)), text(exit_mrad), text(travel_frames), text(entry_mrad)]))
            exit = None if exit_mrad is None else Exit.from_bearing_mrad(exit_mrad)
            observed = mapper.observe(frame, exit=exit, travel_frames=travel_frames, entry_mrad=entry_mrad)
            if observed is not None:
                place, update = observed
                found.append(f"{place.radius_mm} {update.vertex}")
        expected = run(MAP_LINES, name, "frames", sonars, seed, lines="\n".join(lines)).splitlines()
        self.assertEqual([*found, f"{mapper.map.digest} {round(mapper.map_probability * 65536)}"], expected)
        return len(found)

    def test_of_ring_frames_with_each_filter(self) -> None:
        for name in CONFIGS:
            with self.subTest(name):
                self.assertGreater(self.check_frames(name, 16, 1, office()), 10)
                self.assertGreater(self.check_frames(name, 16, 2, corridor(16, 3)), 5)
                self.check_frames(name, 5, 3, corridor(5, 4))

    def test_of_places_with_each_filter(self) -> None:
        for name, new in FILTERS.items():
            for seed in (1, 2**64 - 1):
                with self.subTest(name, seed=seed):
                    self.check_places(name, new, seed)

    def check_places(self, name: str, new: Callable[..., toposlam.Filter], seed: int) -> None:
        draw = random.Random(seed)
        filter, lines, found = new(seed=seed), [], []
        for number in range(60):
            radius_mm = draw.choice([600, 900, 1500, 2200]) + draw.randrange(-20, 21)
            others = sorted(draw.sample(range(1, 6283, 700), draw.randrange(0, 4)))
            ways, ways_text = draw.choice([(None, ""), (3, "3"), (others, " " + " ".join(map(str, others)))])
            exit, exit_text = draw.choice(
                [(None, ""), (Exit.BACK, "back"), (Exit.ON, "on"), (Exit.from_bearing_mrad(1571), "1571")]
            )
            travel_frames = draw.choice([None, draw.randrange(1, 300)])
            starts = draw.random() < 0.05
            lines.append(f"{radius_mm},{ways_text},{exit_text},{text(travel_frames)},{'1' if starts else ''}")
            update = filter.observe(
                radius_mm, ways=ways, exit=exit, travel_frames=travel_frames, starts_sequence=starts
            )
            found.append(f"{radius_mm} {update.vertex}")
            self.assertEqual(update.place_index, number)
            filter.refine(3)
        expected = run(MAP_LINES, name, "places", seed, 3, lines="\n".join(lines)).splitlines()
        self.assertEqual([*found, f"{filter.map.digest} {round(filter.map_probability * 65536)}"], expected)

    def test_of_a_csv_file_that_replay_maps(self) -> None:
        slots = 32
        ring = 'sonars = 16\nunit = "mm"\nmax_range = 6000\nstep_deg = 22.5\ncolumns = ['
        ring += ", ".join(f'"s{sensor}_mm"' for sensor in range(16)) + "]\n"
        frames = REPOSITORY / "examples/frames.csv"
        # `replay` has 32 slots: 16 bearings and 16 dead ones straight ahead. A word is a dead sensor to it.
        bearings = [round(math.radians((22.5 * sensor + 180) % 360 - 180) * 1000) for sensor in range(16)]
        bearings[8] = 3142
        configs: dict[str, Config] = {"robust": RobustConfig(), "paper": PaperConfig(direction="history-to-map")}
        for name, config in configs.items():
            mapper = Mapper(bearings + [0] * (slots - 16), config, place=PlaceConfig(settle_frames=15))
            for row in list(csv.reader(io.StringIO(frames.read_text())))[1:]:
                ranges = [float(value) if value.isdigit() else math.nan for value in row]
                mapper.observe([math.inf if value >= 6000 else value for value in ranges] + [math.nan] * (slots - 16))
            with tempfile.TemporaryDirectory() as folder:
                (Path(folder) / "ring.toml").write_text(ring)
                printed = run(TOPOSLAM, "replay", frames, "--ring", Path(folder) / "ring.toml", "--filter", name)
            vertices = re.findall(r"vertex +\d+: radius +(\d+) mm, (\d+) visits?", printed)
            self.assertEqual([(str(v.radius_mm), str(v.visits)) for v in mapper.map.vertices], vertices)
            edges = re.search(r"edges: (.*)", printed)
            assert edges
            self.assertEqual(" ".join(f"{a}-{b}" for a, b in mapper.map.edges), edges[1])
            self.assertGreater(len(vertices), 3)


class Inputs(unittest.TestCase):
    def test_a_detector_finds_the_places_of_a_mapper(self) -> None:
        detector, mapper, places = PlaceDetector(16), Mapper(16), 0
        for frame in office():
            place, observed = detector.observe(frame), mapper.observe(frame)
            self.assertEqual(place, observed and observed[0])
            places += place is not None
        self.assertEqual(mapper.observed, places)
        self.assertEqual(len(mapper.path), places)
        self.assertFalse(detector.is_blind)

    def test_none_infinity_and_silence_are_the_same_and_so_are_nan_and_dead(self) -> None:
        numbers: dict[Any, Any] = {"silence": math.inf, "dead": math.nan}
        objects: dict[Any, Any] = {"silence": None, "dead": math.nan}
        frames = corridor(16, 7)
        maps = []
        for words in ({}, numbers, objects):
            mapper = Mapper(16)
            for frame in frames:
                mapper.observe(words.get(value, value) for value in frame)
            maps.append(mapper.map)
        self.assertEqual(maps[0], maps[1])
        self.assertEqual(maps[0], maps[2])
        self.assertGreater(len(maps[0].vertices), 1)

    def test_arrays_of_numpy_are_frames(self) -> None:
        try:
            import numpy
        except ImportError:
            raise unittest.SkipTest("no numpy") from None
        words = {"silence": math.inf, "dead": math.nan}
        lists, arrays = Mapper(16), Mapper(numpy.arange(16) * 6283 // 16 - 3141)
        other = Mapper([sensor * 6283 // 16 - 3141 for sensor in range(16)])
        for frame in office():
            numbers = [words.get(value, value) for value in frame]  # type: ignore[arg-type]
            self.assertEqual(other.observe(frame), arrays.observe(numpy.array(numbers, dtype=numpy.float32)))
            lists.observe(frame)
        self.assertEqual(other.map, arrays.map)
        self.assertEqual(PlaceDetector(4).observe(numpy.array([1, 2, 3, 4], dtype=numpy.uint16)), None)

    def test_points_of_a_scan_become_a_frame(self) -> None:
        bearings = [degree * 6283 / 360 for degree in range(360)]
        ranges = [700 if degree == 178 else 2000 for degree in range(360)]
        self.assertEqual(ring_frame(bearings, ranges, 8), [2000, 2000, 2000, 2000, 700, 2000, 2000, 2000])
        self.assertEqual(ring_frame([], [], 8), [None] * 8)
        self.assertRaisesRegex(ValueError, "fewer ranges", ring_frame, [1], [], 8)
        self.assertRaisesRegex(ValueError, "more ranges", ring_frame, [1], [1, 2], 8)

    def test_each_invalid_value_raises_and_the_mapper_goes_on(self) -> None:
        mapper = Mapper(16)
        robust = toposlam.RobustFilter()
        # What a type checker would refuse as well.
        untyped: Any = toposlam
        observe: Any = mapper.observe
        cases: list[tuple[type[Exception], str, Callable[[], Any]]] = [
            (ValueError, "4 to 32 sensors, not 3", lambda: Mapper(3)),
            (ValueError, "4 to 32 sensors, not 33", lambda: Mapper([0] * 33)),
            (ValueError, "ring is -1", lambda: Mapper(-1)),
            (ValueError, "from -3142 to 3142", lambda: Mapper([5000] * 16)),
            (TypeError, "ring must be an integer", lambda: untyped.Mapper(None)),
            (TypeError, "must be an OrderedConfig", lambda: untyped.Mapper(16, "robust")),
            (ValueError, "seed is -1", lambda: Mapper(16, seed=-1)),
            (ValueError, "from 3 to 16", lambda: Mapper(16, place=PlaceConfig(live_sensors_min=20))),
            (ValueError, "has 16 ranges, not 15", lambda: mapper.observe([1] * 15)),
            (ValueError, "has 16 ranges, not 17", lambda: mapper.observe([1] * 17)),
            (ValueError, "not be negative", lambda: mapper.observe([-1] * 16)),
            (ValueError, 'a range is "far"', lambda: mapper.observe(["far"] * 16)),
            (TypeError, "a range must be a number, not list", lambda: observe([[]] * 16)),
            (TypeError, "not iterable", lambda: observe(None)),
            (ValueError, "travel_frames is 0", lambda: mapper.observe([1] * 16, travel_frames=0)),
            (ValueError, "entry_mrad is 40000", lambda: mapper.observe([1] * 16, entry_mrad=40000)),
            (ValueError, "above 8188 mm", lambda: robust.observe(9000)),
            (ValueError, "radius_mm is nan", lambda: robust.observe(math.nan)),
            (ValueError, "not ascending", lambda: robust.observe(900, ways=[5, 4])),
            (ValueError, "at most 7 ways", lambda: robust.observe(900, ways=8)),
            (TypeError, "ways must be an integer", lambda: untyped.RobustFilter().observe(900, ways=2.5)),
            (ValueError, "full turn", lambda: Exit.from_bearing_mrad(6283)),
            (ValueError, "noise_mm is 2000, but must be from 1 to 1000", lambda: RobustConfig(noise_mm=2000)),
            (ValueError, "noise_mm is 1180591620717411303424", lambda: OrderedConfig(noise_mm=1 << 70)),
            (ValueError, "direction is", lambda: untyped.PaperConfig(direction="left")),
            (TypeError, 'no field "noise"', lambda: untyped.OrderedConfig(noise=3)),
            (ValueError, "format is", lambda: untyped.Mapper(4).map.export("png")),
        ]
        for error, words, call in cases:
            with self.subTest(words):
                self.assertRaisesRegex(error, words, call)
        self.assertEqual((mapper.observed, robust.observed), (0, 0))
        robust.observe(900, ways=numpy_free_index())
        self.assertEqual(robust.map.location, 0)

    def test_an_object_that_raises_while_it_is_read_raises_the_same(self) -> None:
        def ranges() -> Any:
            yield 1
            raise KeyError("a sensor")

        self.assertRaisesRegex(KeyError, "a sensor", Mapper(16).observe, ranges())

    def test_settings_have_the_defaults_of_their_signature(self) -> None:
        for config in (*CONFIGS.values(), PlaceConfig()):
            signature = re.findall(r"(\w+)=(\d+)", type(config).__text_signature__ or "")
            self.assertGreater(len(signature), 4)
            for field, default in signature:
                self.assertEqual(getattr(config, field), int(default), field)
        self.assertEqual(PlaceConfig.for_ring(16), PlaceConfig())
        eight = PlaceConfig.for_ring(8, settle_frames=15)
        self.assertEqual((eight.settle_frames, eight.live_sensors_min), (15, 3))
        self.assertGreater(eight.separation_mrad, PlaceConfig().separation_mrad)


class Outputs(unittest.TestCase):
    def test_a_map_with_ways_has_its_frontiers(self) -> None:
        filter = toposlam.OrderedFilter()
        filter.observe(900, ways=[])
        filter.observe(1500, ways=[1571, 4712], exit=Exit.BACK, travel_frames=50)
        map = filter.map
        self.assertEqual((map.edges, map.location), ([(0, 1)], 1))
        self.assertEqual([len(ways) for ways in map.ways], [1, 3])
        self.assertEqual(len(map.frontiers), 2)
        self.assertEqual(map.ways[0][0].travel_frames, 50)
        self.assertEqual(map.ways[0][0].leads_to and map.ways[0][0].leads_to[0], 1)
        # The second place may also be none.
        self.assertEqual(filter.belief[0], 0.0)
        self.assertGreater(filter.belief[1], 0.99)
        self.assertEqual(repr(map), "<Map of 2 vertices and 1 edges>")
        self.assertIn("<svg", map._repr_svg_())
        self.assertTrue(map.export("dot") and map.export("geojson") and map.export("graphml") and map.export("json"))

    def test_a_filter_that_only_localises_keeps_its_map(self) -> None:
        for new in (toposlam.OrderedFilter, toposlam.RobustFilter):
            filter = new()
            for radius_mm in (900, 1500, 900, 1500):
                filter.observe(radius_mm, exit=Exit.BACK)
                filter.refine(20)
            filter.localise_only = True
            edges, vertices = filter.map.edges, len(filter.map.vertices)
            filter.observe(2500)
            self.assertTrue(filter.localise_only)
            self.assertEqual((filter.map.edges, len(filter.map.vertices)), (edges, vertices))

    def test_a_map_that_is_full_is_counted_as_a_fault(self) -> None:
        filter = toposlam.PaperFilter()
        for radius_mm in range(500, 8000, 400):
            filter.observe(radius_mm)
        self.assertIn("VerticesFull", filter.faults)


class Documentation(unittest.TestCase):
    DOCUMENT = (REPOSITORY / "docs/python.md").read_text()
    EXAMPLES = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)

    def test_the_examples_of_the_document_run(self) -> None:
        lines = []
        for example in self.EXAMPLES:
            if "import" in example:
                command = [sys.executable, "-c", example]
                printed = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=True).stdout
                lines.append(printed.splitlines()[-1])
        mapper = Mapper(16)
        for row in list(csv.reader(io.StringIO((REPOSITORY / "examples/frames.csv").read_text())))[1:]:
            mapper.observe(int(value) if value.isdigit() else value for value in row)
        self.assertEqual(lines[0], str(mapper.map.edges))
        self.assertTrue(lines[1].startswith("[(0, 1)] [(1, "), lines[1])

    def test_the_stub_is_that_of_the_module_and_the_document_passes_mypy(self) -> None:
        try:
            import mypy  # noqa: F401
        except ImportError:
            assert "CI" not in os.environ, "mypy is missing"
            raise unittest.SkipTest("mypy is missing") from None
        commands = [
            ["mypy.stubtest", "--ignore-disjoint-bases", "toposlam"],
            ["mypy", "--strict", "-c", self.EXAMPLES[0]],
            ["mypy", "--strict", "--follow-imports=silent", str(PYTHON / "examples/map_csv.py"), __file__],
        ]
        for command in commands:
            with tempfile.TemporaryDirectory() as folder:
                environment = {**os.environ, "MYPYPATH": str(PYTHON)}
                checked = subprocess.run(
                    [sys.executable, "-m", *command], cwd=folder, env=environment, capture_output=True, text=True
                )
            self.assertEqual(checked.returncode, 0, checked.stdout)

    def test_every_class_and_function_is_documented(self) -> None:
        for name in toposlam.__all__:
            item = getattr(toposlam, name)
            self.assertTrue(item.__doc__, name)
            for member, value in vars(item).items() if isinstance(item, type) else []:
                if not member.startswith("_") and callable(value):
                    self.assertTrue(value.__doc__, f"{name}.{member}")


def numpy_free_index() -> Any:
    """An integer of another type, as that of an array."""

    class Index:
        def __index__(self) -> int:
            return 2

    return Index()


if __name__ == "__main__":
    unittest.main()
