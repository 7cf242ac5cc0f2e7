"""The package rosbags reads the bags of `toposlam record --ros2`.

`TOPOSLAM=path/to/toposlam python3 -m unittest test_ros2`, with what requirements-ros2.txt names.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

from requirement import require

REPOSITORY = Path(__file__).resolve().parents[2]
TOPOSLAM = os.environ.get("TOPOSLAM", str(REPOSITORY / "target" / "debug" / "toposlam"))

missing = []
try:
    from rosbags.highlevel import AnyReader
except ImportError as error:
    missing.append(str(error.name))


def setUpModule() -> None:
    require(missing, "the ROS 2 bags were not read by another program")


class Ros2Bag(unittest.TestCase):
    """A bag of a simulated robot."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.bag = Path(cls.folder.name) / "office"
        command = [TOPOSLAM, "robot", "--listen", "127.0.0.1:0", "--speed", "50"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as robot:
            try:
                line = robot.stdout.readline().split()[-1]
                command = [TOPOSLAM, "record", line, str(cls.bag), "--ros2", "--frame-mm", "30"]
                subprocess.run([*command, "--places", "12"], check=True, timeout=120, stdout=subprocess.DEVNULL)
            finally:
                robot.kill()
        with AnyReader([cls.bag]) as reader:
            cls.topics = {topic: info.msgtype for topic, info in reader.topics.items()}
            cls.messages = [
                (connection.topic, time_ns, reader.deserialize(data, connection.msgtype))
                for connection, time_ns, data in reader.messages()
            ]
            cls.count = reader.message_count

    def of(self, topic: str) -> list:
        return [message for name, _, message in self.messages if name == f"/toposlam/{topic}"]

    def test_the_topics_have_the_types_of_ros(self) -> None:
        types = {
            "/toposlam/scan": "sensor_msgs/msg/LaserScan",
            "/toposlam/map": "visualization_msgs/msg/MarkerArray",
            "/toposlam/route_graph": "std_msgs/msg/String",
        }
        self.assertEqual(self.topics, types)
        self.assertEqual(self.count, len(self.messages))

    def test_a_scan_is_the_ring_in_metres(self) -> None:
        scans = self.of("scan")
        self.assertGreater(len(scans), 5)
        for scan in scans:
            self.assertEqual((scan.header.frame_id, len(scan.ranges), len(scan.intensities)), ("robot", 16, 0))
            self.assertAlmostEqual(scan.angle_increment, 2 * math.pi / 16, places=5)
            self.assertAlmostEqual(scan.angle_max, 15 * scan.angle_increment, places=4)
            self.assertTrue(all(math.isinf(r) or math.isnan(r) or scan.range_min <= r <= scan.range_max for r in scan.ranges))

    def test_the_markers_draw_each_vertex_and_each_edge_of_the_route_graph(self) -> None:
        graph = json.loads(self.of("route_graph")[-1].data)["features"]
        points = [feature for feature in graph if feature["geometry"]["type"] == "Point"]
        markers = self.of("map")[-1].markers
        self.assertEqual((markers[0].action, markers[0].header.frame_id), (3, "map"))
        discs = [marker for marker in markers if marker.ns == "places"]
        names = [marker.text for marker in markers if marker.ns == "names"]
        self.assertEqual([disc.id for disc in discs], list(range(len(points))))
        for disc, name, point in zip(discs, names, points, strict=True):
            radius_m = point["properties"]["metadata"]["radius_m"]
            self.assertEqual(name, f"{disc.id}: {round(1000 * radius_m)} mm")
            self.assertAlmostEqual(disc.scale.x, 2 * max(radius_m, 0.1))
            at = (disc.pose.position.x, disc.pose.position.y)
            self.assertLess(math.dist(at, point["geometry"]["coordinates"]), 0.002)
        (edges,) = [marker for marker in markers if marker.ns == "edges"]
        self.assertGreaterEqual(len(edges.points) / 2, len(points) - 1)

    def test_a_line_of_the_route_graph_costs_its_travel_time_times_the_speed(self) -> None:
        graph = json.loads(self.of("route_graph")[-1].data)["features"]
        lines = [f["properties"] for f in graph if f["geometry"]["type"] == "LineString"]
        timed = [line for line in lines if "travel_frames" in line.get("metadata", {})]
        self.assertGreater(len(timed), 0)
        for line in timed:
            self.assertAlmostEqual(line["cost"], 0.03 * line["metadata"]["travel_frames"])


if __name__ == "__main__":
    unittest.main()
