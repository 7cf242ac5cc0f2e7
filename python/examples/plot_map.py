"""Plots the map of a robot as it grows, with its frontiers, where the robot is, what its sonars say and where it steers.

    pip install './python[plot]'
    python python/examples/plot_map.py tcp:127.0.0.1:7070
    python python/examples/plot_map.py tcp:127.0.0.1:7070 --save map.png --seconds 60

The map has no coordinates: springs along its edges arrange the vertices. The area of a vertex grows with its radius.
"""

from __future__ import annotations

import argparse
import cmath
import math
import random
import time
from pathlib import Path

import matplotlib

from toposlam_stream import DEAD, SILENCE, Decoder, Event, Received, Line, MapReplica, Remapped, WayId, open_line

SECONDS_A_PICTURE = 0.2
STUB = 0.35
"""The length of a frontier, a way that nobody has driven."""
SILENT_MM = 6000
"""Where a sonar without an echo is drawn."""


class Arrangement:
    """A place on the paper for each vertex, that changes little from one map to the next."""

    def __init__(self) -> None:
        self._points: dict[int, complex] = {}
        self._random = random.Random(1)

    def remap(self, remapped: Remapped) -> None:
        """Lets the vertices keep their places under their new numbers."""
        named = ((remapped.now(vertex), point) for vertex, point in self._points.items())
        self._points = {vertex: point for vertex, point in named if vertex is not None}

    def arrange(self, vertices: int, edges: list[tuple[int, int]]) -> dict[int, complex]:
        """Forces of springs: vertices repel each other, edges pull."""
        neighbours = {vertex: [a + b - vertex for a, b in edges if vertex in (a, b)] for vertex in range(vertices)}
        points = {}
        for vertex in range(vertices):
            beside = [self._points[other] for other in neighbours[vertex] if other in self._points]
            near = sum(beside) / len(beside) if beside else 0
            points[vertex] = self._points.get(vertex, near + complex(self._random.uniform(-1, 1), self._random.uniform(-1, 1)))
        for step in range(60):
            forces = {}
            for vertex, point in points.items():
                apart = (point - other for at, other in points.items() if at != vertex)
                push = sum(away / (abs(away) ** 2 + 0.01) for away in apart)
                pull = sum((points[other] - point) * abs(points[other] - point) for other in neighbours[vertex])
                forces[vertex] = push + pull - 0.02 * point
            longest = 0.3 * (1 - step / 60)
            for vertex, force in forces.items():
                points[vertex] += force * min(0.1, longest / (abs(force) + 1e-9))
        self._points = points
        return points


def draw(figure, replica: MapReplica, arrangement: Arrangement, decoder: Decoder) -> None:
    """Draws all that is known."""
    figure.clear()
    paper = figure.add_subplot(1, 2, 1)
    points = arrangement.arrange(replica.vertices, replica.edges())
    draw_edges(paper, replica, points)
    for frontier in replica.frontiers():
        point = points[frontier.vertex]
        end = point + cmath.rect(STUB, direction(replica, points, frontier))
        paper.plot([point.real, end.real], [point.imag, end.imag], ":", color="tab:orange", linewidth=2, zorder=1)
    for vertex, point in points.items():
        row = replica.row(vertex)
        is_here = replica.location is not None and replica.location.vertex == vertex
        area = 120 + (row.radius_mm / 8 if row else 0)
        paper.scatter(point.real, point.imag, s=area, color="tab:red" if is_here else "tab:blue", zorder=2)
        paper.annotate(str(vertex), (point.real, point.imag), color="white", ha="center", va="center", zorder=3)
    paper.set_aspect("equal", adjustable="datalim")
    paper.margins(0.15)
    paper.set_axis_off()
    state = "as the robot has it" if replica.is_converged() else "it may lack things"
    edges = max(len(replica.edges()), len(replica.way_edges()))
    frontiers = f", {len(replica.frontiers())} frontiers" if replica.exploration else ""
    paper.set_title(f"{replica.vertices} places, {edges} edges{frontiers}: {state}")
    draw_surroundings(figure.add_subplot(1, 2, 2, projection="polar"), replica)
    figure.suptitle(f"{decoder.counters.messages} messages, {decoder.counters.lost} lost (red: the robot is here)")


def draw_edges(paper, replica: MapReplica, points: dict[int, complex]) -> None:
    """Draws the edges: parallel ones as arcs beside each other, loops as circles."""
    pairs = [tuple(sorted((one.vertex, other.vertex))) for one, other in replica.way_edges()]
    pairs += [pair for pair in replica.edges() if pair not in pairs]
    for number, (a, b) in enumerate(pairs):
        parallel = pairs[:number].count((a, b))
        if a == b:
            size = 26 + 8 * parallel
            paper.plot(points[a].real, points[a].imag, "o", markersize=size, markerfacecolor="none", color="0.6", zorder=1)
            continue
        arc = f"arc3,rad={0.25 * parallel}"
        ends = [(points[vertex].real, points[vertex].imag) for vertex in (a, b)]
        paper.annotate("", ends[0], ends[1], arrowprops={"arrowstyle": "-", "connectionstyle": arc, "color": "0.6"}, zorder=1)


def direction(replica: MapReplica, points: dict[int, complex], frontier: WayId) -> float:
    """The direction of a frontier in the picture: as far from the first drawn edge of its vertex as its bearing is."""
    ways = replica.ways(frontier.vertex)
    bearing = ways[frontier.way].bearing_mrad / 1000
    for way in ways:
        if way.leads_to and way.leads_to.vertex in points and way.leads_to.vertex != frontier.vertex:
            along = points[way.leads_to.vertex] - points[frontier.vertex]
            return cmath.phase(along) + bearing - way.bearing_mrad / 1000
    return bearing


def draw_surroundings(axes, replica: MapReplica) -> None:
    """The ranges of sonars that stand evenly, counter-clockwise from straight ahead, without the dead ones; and where the
    drive steers."""
    axes.set_theta_zero_location("N")
    axes.set_rlim(0, SILENT_MM)
    if replica.velocity:
        bearing = replica.velocity.heading_mrad / 1000
        axes.plot([bearing, bearing], [0, SILENT_MM * replica.velocity.speed_permille / 1000], color="tab:red")
    if replica.ring is None:
        axes.set_title("the robot sends no ring frames; red: its drive")
        return
    echoes = replica.ring.ranges_mm
    sonars = [(number, echo) for number, echo in enumerate(echoes) if echo != DEAD]
    bearings = [2 * math.pi * number / len(echoes) for number, _ in sonars]
    ranges_mm = [SILENT_MM if echo == SILENCE else min(echo, SILENT_MM) for _, echo in sonars]
    axes.fill(bearings, ranges_mm, alpha=0.3)
    axes.plot(bearings, ranges_mm, "o")
    axes.set_title(f"ring frame {replica.ring.frame_index}, mm; red: the drive")


def listen(line: Line, decoder: Decoder, replica: MapReplica, arrangement: Arrangement) -> bool:
    """Takes in what has come; false when the line has ended."""
    try:
        events: list[Event] = decoder.feed(line.read())
    except EOFError:
        return False
    for event in events:
        if isinstance(event, Received) and isinstance(event.message, Remapped):
            # The vertices that are on the paper, before the map takes their new numbers.
            arrangement.remap(event.message)
        replica.apply(event)
    return True


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description="Plots the map of a robot as it grows.")
    parser.add_argument("line", help="tcp:HOST:PORT, a serial port, or a file of raw bytes")
    parser.add_argument("--save", type=Path, help="write a picture to this file at the end, and open no window")
    parser.add_argument("--seconds", type=float, default=math.inf, help="stop after this long")
    arguments = parser.parse_args()
    if arguments.save:
        matplotlib.use("Agg")
    from matplotlib import pyplot

    decoder, replica, arrangement = Decoder(), MapReplica(), Arrangement()
    figure = pyplot.figure(figsize=(11, 5.5))
    begun = drawn = time.monotonic()
    with open_line(arguments.line) as line:
        while listen(line, decoder, replica, arrangement):
            now = time.monotonic()
            if now - begun > arguments.seconds or not (arguments.save or pyplot.fignum_exists(figure.number)):
                break
            if not arguments.save and now - drawn > SECONDS_A_PICTURE:
                draw(figure, replica, arrangement, decoder)
                pyplot.pause(0.001)
                drawn = now
    draw(figure, replica, arrangement, decoder)
    if arguments.save:
        figure.savefig(arguments.save)
    elif pyplot.fignum_exists(figure.number):
        pyplot.show()


if __name__ == "__main__":
    main()
