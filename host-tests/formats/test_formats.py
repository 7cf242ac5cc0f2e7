"""Other programs open what `toposlam export` writes: `python3 -m unittest` in this folder.

A simulated robot explores the office; its map is exported from the bytes that it sent. `TOPOSLAM` is the command to test,
../../target/debug/toposlam unless set. Needs Graphviz and librsvg2-bin beside requirements.txt.
"""

from __future__ import annotations

import io
import itertools
import json
import os
import shutil
import socket
import subprocess
import tempfile
import unittest
from pathlib import Path

import geojson
import jsonschema
import networkx
from PIL import Image
from shapely.geometry import shape

ROOT = Path(__file__).resolve().parents[2]
TOPOSLAM = os.environ.get("TOPOSLAM", str(ROOT / "target/debug/toposlam"))
PLACES = 60
EDGE_M = 4.0
POINTS_PER_EDGE = 144
MAP_COLOUR, ROBOT_COLOUR = (0xB3, 0x26, 0x1E), (0x0B, 0x57, 0xD0)


class Robot:
    """A simulated robot at the other end of a TCP line."""

    def __init__(self, *arguments: str) -> None:
        command = [TOPOSLAM, "robot", "--listen", "127.0.0.1:0", "--speed", "1000", *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self.line = self.process.stdout.readline().split()[-1]

    def recording(self) -> bytes:
        """All that it says until it ends."""
        _, host, port = self.line.split(":")
        with socket.create_connection((host, int(port))) as connection:
            return b"".join(iter(lambda: connection.recv(1 << 16), b""))

    def __enter__(self) -> Robot:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()


def export(source: str, form: str, *arguments: str, said: bytes | None = None) -> str:
    command = [TOPOSLAM, "export", source, "--format", form, *arguments]
    return subprocess.run(command, input=said, check=True, stdout=subprocess.PIPE).stdout.decode()


class Formats(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.directory = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.directory.cleanup)
        cls.file = str(Path(cls.directory.name) / "robot.bin")
        with Robot("--plan", "office", "--places", str(PLACES)) as robot:
            cls.said = robot.recording()
        Path(cls.file).write_bytes(cls.said)
        cls.map = json.loads(export(cls.file, "json"))
        cls.here = cls.map["location"]
        cls.edges = {tuple(edge) for edge in cls.map["edges"]}

    def run_program(self, *command: str, given: str) -> bytes:
        if shutil.which(command[0]) is None:
            print(f"SKIPPED: {self.id()}: {command[0]} is not installed")
            self.assertNotIn("CI", os.environ, f"{command[0]} is not installed")
            self.skipTest(f"{command[0]} is not installed")
        return subprocess.run(command, input=given.encode(), check=True, stdout=subprocess.PIPE).stdout

    def test_the_map_is_worth_exporting(self) -> None:
        self.assertGreaterEqual(len(self.map["vertices"]), 8)
        self.assertGreaterEqual(len(self.edges), len(self.map["vertices"]) - 1)
        self.assertIsInstance(self.here, int)

    def test_json_follows_its_schema(self) -> None:
        schema = json.loads((ROOT / "docs/map.schema.json").read_text())
        jsonschema.Draft202012Validator.check_schema(schema)
        jsonschema.validate(self.map, schema)
        with self.assertRaises(jsonschema.ValidationError):
            jsonschema.validate({**self.map, "edges": [[0]]}, schema)

    def test_a_file_the_standard_input_and_an_output_file_hold_the_same(self) -> None:
        output = Path(self.directory.name) / "map.json"
        self.assertEqual(export("-", "json", "--output", str(output), said=self.said), "")
        self.assertEqual(json.loads(output.read_text()), self.map)

    def test_a_robot_on_its_line_gives_its_map(self) -> None:
        with Robot("--plan", "ring") as robot:
            schema = json.loads((ROOT / "docs/map.schema.json").read_text())
            found = {"vertices": []}
            while len(found["vertices"]) < 4:
                answer = subprocess.run([TOPOSLAM, "export", robot.line, "--format", "json"], capture_output=True)
                found = json.loads(answer.stdout or '{"vertices": []}')
            jsonschema.validate(found, schema)
            self.assertIsInstance(found["location"], int)

    def test_networkx_reads_graphml_with_numbers_as_numbers(self) -> None:
        graph = networkx.read_graphml(io.BytesIO(export(self.file, "graphml").encode()), node_type=int)
        self.assertFalse(graph.is_directed())
        self.assertEqual({tuple(sorted(edge)) for edge in graph.edges()}, self.edges)
        ways = self.map.get("ways")
        if ways:
            self.assertEqual(graph.number_of_edges(), len(self.map["way_edges"]))
            frames = sorted(edge["travel_frames"] or 0 for edge in self.map["way_edges"])
            self.assertEqual(sorted(data.get("travel_frames", 0) for *_, data in graph.edges(data=True)), frames)
        for vertex in self.map["vertices"]:
            number = vertex["vertex"]
            expected = {key: vertex[key] for key in ("radius_mm", "visits", "x", "y")}
            if ways:
                frontiers = [str(way["way"]) for way in self.map["frontiers"] if way["vertex"] == number]
                bearings = [str(way["bearing_mrad"]) for way in ways[number]]
                expected |= {"ways": len(ways[number]), "frontiers": " ".join(frontiers), "bearings_mrad": " ".join(bearings)}
            found = {"frontiers": "", **graph.nodes[number]} if ways else graph.nodes[number]
            self.assertEqual(found, {**expected, "robot_is_here": number == self.here})

    def test_graphml_that_networkx_has_written_again_is_the_same_map(self) -> None:
        named = {**self.map, "vertices": [dict(vertex) for vertex in self.map["vertices"]]}
        named["vertices"][1]["name"] = "Büro <2>"
        source, again = (str(Path(self.directory.name) / name) for name in ("named.json", "again.graphml"))
        Path(source).write_text(json.dumps(named))
        graph = networkx.read_graphml(io.BytesIO(export(source, "graphml").encode()), node_type=int)
        networkx.write_graphml(graph, again)
        found = json.loads(export(again, "json"))
        for field in ("edges", "ways"):
            self.assertEqual(found[field], named[field])
        labels = lambda map: [(v["radius_mm"], v["visits"], v.get("name")) for v in map["vertices"]]
        self.assertEqual(labels(found), labels(named))

    def test_graphviz_keeps_the_positions_and_the_edges(self) -> None:
        dot = export(self.file, "dot")
        laid_out = json.loads(self.run_program("neato", "-n", "-Tjson", given=dot))
        positions = {node["name"]: [float(value) for value in node["pos"].split(",")] for node in laid_out["objects"]}
        # Graphviz moves the whole picture, and nothing in it.
        first = self.map["vertices"][0]
        for vertex in self.map["vertices"]:
            for axis, name in enumerate("xy"):
                moved = positions[str(vertex["vertex"])][axis] - positions["0"][axis]
                self.assertAlmostEqual(moved, POINTS_PER_EDGE * (vertex[name] - first[name]), delta=0.1)
        names = [int(node["name"]) for node in laid_out["objects"]]
        edges = {tuple(sorted((names[edge["tail"]], names[edge["head"]]))) for edge in laid_out.get("edges", [])}
        self.assertEqual(edges, self.edges)
        self.assertIn(b"<svg", self.run_program("dot", "-Tsvg", given=dot))

    def test_geojson_is_valid_and_a_route_graph_as_nav2_loads_it(self) -> None:
        collection = geojson.loads(export(self.file, "geojson", "--edge-m", str(EDGE_M)))
        self.assertTrue(collection.is_valid, collection.errors())
        for feature in collection.features:
            self.assertTrue(shape(feature.geometry).is_valid)
        # As Nav2's loader does it: points are nodes, other features lines between nodes that exist; numbers are unique.
        nodes = {f.properties["id"]: f for f in collection.features if f.geometry.type == "Point"}
        lines = [f for f in collection.features if f.geometry.type == "LineString"]
        numbers = [feature.properties["id"] for feature in collection.features]
        self.assertEqual(len(set(numbers)), len(nodes) + len(lines))
        ways = {(line.properties["startid"], line.properties["endid"]) for line in lines}
        self.assertEqual(ways, {way for a, b in self.edges if a != b for way in ((a, b), (b, a))})
        for vertex in self.map["vertices"]:
            node = nodes[vertex["vertex"]]
            for axis, name in enumerate("xy"):
                self.assertAlmostEqual(node.geometry.coordinates[axis], EDGE_M * vertex[name], delta=0.001)
            self.assertEqual(node.properties["metadata"]["radius_m"], vertex["radius_mm"] / 1000)

    def test_the_lines_of_the_drawing_do_not_cross(self) -> None:
        graph = networkx.Graph(self.edges)
        self.assertTrue(networkx.check_planarity(graph)[0], "the office's map is planar")
        collection = geojson.loads(export(self.file, "geojson"))
        lines = []
        for feature in collection.features:
            if feature.geometry.type == "LineString" and feature.properties["startid"] < feature.properties["endid"]:
                ends = frozenset((feature.properties["startid"], feature.properties["endid"]))
                lines.append((ends, shape(feature.geometry)))
        for (one, first), (other, second) in itertools.combinations(lines, 2):
            self.assertTrue(one & other or not first.intersects(second), f"{set(one)} crosses {set(other)}")

    def test_a_renderer_draws_the_svg(self) -> None:
        image = Image.open(io.BytesIO(self.run_program("rsvg-convert", given=export(self.file, "svg")))).convert("RGB")
        colours = {colour for _, colour in image.getcolors(maxcolors=1 << 24)}
        self.assertLessEqual({MAP_COLOUR, ROBOT_COLOUR, (0xFF, 0xFF, 0xFF)}, colours)
        self.assertGreater(min(image.size), 100)


if __name__ == "__main__":
    unittest.main()
