"""Tests of the scoring, the reading and the peers: `python3 -m unittest` in this folder."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import unittest
from pathlib import Path

import peers
from categories import categorise
from measure import PEERS, measure
from observations import Ways, read_radii_mm, read_rows, read_truth
from path_map import PathMap, chain_criterion, map_of_path, undirected
from score import Score, score_map
from synthetic_export import (
    ALL_DIFFERENT,
    LOOK_ALIKE_NEIGHBOURS,
    LOOK_ALIKES_IN_A_RING,
    WEAN_SURROGATE_SD,
    smallest_equivalent,
    write_export,
)
from table import read_ours

# A triangle with a tail, 0-1-2-0 and 2-3, as in the tests of score.rs.
TRUE_EDGES = undirected([(0, 1), (1, 2), (0, 2), (2, 3)])
CLASSES = (0, 1, 2, 3, 2, 0, 1, 2)


def score(vertex_count: int, edges: list[tuple[int, int]], path: tuple[int, ...]) -> Score:
    return score_map(PathMap(path, vertex_count, undirected(edges)), 4, TRUE_EDGES, CLASSES)


class Scoring(unittest.TestCase):
    """The hand-made cases of score.rs, with the same expectations."""

    def test_a_renumbered_truth_is_exact(self) -> None:
        # 0 -> 2, 1 -> 0, 2 -> 3, 3 -> 1
        found = score(4, [(2, 0), (0, 3), (2, 3), (3, 1)], (2, 0, 3, 1, 3, 2, 0, 3))
        self.assertEqual(found, Score(True, True, 1.0, 1.0))

    def test_one_wrong_visit_costs_location_but_not_the_map(self) -> None:
        found = score(4, sorted(TRUE_EDGES), (0, 1, 2, 3, 2, 0, 1, 1))
        self.assertEqual(found, Score(True, True, 1.0, 7 / 8))

    def test_a_missing_edge_is_not_exact(self) -> None:
        self.assertEqual(score(4, [(0, 1), (1, 2), (2, 3)], CLASSES), Score(False, False, 6 / 7, 1.0))

    def test_the_right_graph_on_the_wrong_places_is_isomorphic_but_not_exact(self) -> None:
        found = score(4, [(0, 1), (1, 2), (0, 2), (0, 3)], CLASSES)
        self.assertEqual(found, Score(False, True, 6 / 8, 1.0))

    def test_a_place_held_twice_is_not_exact_even_when_all_its_edges_are_right(self) -> None:
        found = score(5, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (0, 4)], (0, 1, 2, 3, 4, 0, 1, 2))
        self.assertEqual(found, Score(False, False, 1.0, 1.0))

    def test_two_places_in_one_vertex_are_not_one_to_one_even_when_the_count_agrees(self) -> None:
        found = score(4, [(0, 1), (1, 2), (2, 2), (2, 3), (1, 3)], (0, 1, 2, 2, 2, 3, 1, 2))
        self.assertFalse(found.exact)
        self.assertEqual(found.location_smoothed, 7 / 8)

    def test_of_two_classes_visited_equally_often_the_lower_wins(self) -> None:
        found = score_map(PathMap((0, 0), 1, frozenset({(0, 0)})), 2, frozenset({(0, 1)}), (1, 0))
        # Vertex 0 stands for class 0, so its self-loop is the pair (0, 0) and not the true pair.
        self.assertEqual(found, Score(False, False, 0.0, 0.5))

    def test_a_self_loop_is_part_of_isomorphism(self) -> None:
        classes = (0, 1, 0)
        truth = undirected([(0, 1), (0, 0)])
        for loop, expected in ((0, True), (1, True), (None, False)):
            edges = [(0, 1)] if loop is None else [(0, 1), (loop, loop)]
            found = score_map(PathMap(classes, 2, undirected(edges)), 2, truth, classes)
            self.assertEqual((found.isomorphic, found.exact), (expected, loop == 0))

    def test_a_path_of_another_length_is_refused(self) -> None:
        with self.assertRaises(ValueError):
            score_map(PathMap((0,), 1, frozenset()), 4, TRUE_EDGES, CLASSES)


class Maps(unittest.TestCase):
    def test_states_are_numbered_by_their_first_visit(self) -> None:
        found = map_of_path(["q7", "q2", "q7", "q5"])
        self.assertEqual(found, PathMap((0, 1, 0, 2), 3, frozenset({(0, 1), (0, 2)})))

    def test_a_self_loop_is_in_the_map_only_where_a_state_follows_itself(self) -> None:
        self.assertEqual(map_of_path([4, 4, 3]).edges, frozenset({(0, 0), (0, 1)}))
        self.assertEqual(map_of_path([4]).edges, frozenset())

    def test_the_criterion_prefers_a_path_that_returns_to_one_that_never_does(self) -> None:
        self.assertGreater(chain_criterion([0, 1] * 20), chain_criterion(list(range(40))))
        # What predicts the next state is worth a state: 0 1 0 2 repeated, with the 0 told apart or not.
        self.assertGreater(chain_criterion([0, 1, 3, 2] * 20), chain_criterion([0, 1, 0, 2] * 20))


class Categories(unittest.TestCase):
    def test_groups_of_radii_become_symbols_in_ascending_order(self) -> None:
        radii_mm = [1500.0, 902.0, 898.0, 2000.0, 1504.0, 900.0, 1996.0, 1498.0, 2002.0, 900.0] * 4
        self.assertEqual(categorise(radii_mm, 1), [1, 0, 0, 2, 1, 0, 2, 1, 2, 0] * 4)

    def test_radii_that_are_all_equal_are_one_symbol(self) -> None:
        self.assertEqual(categorise([900.0] * 5, 1), [0] * 5)


class Exports(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.export = Path(folder.name) / "export"
        write_export(self.export, [ALL_DIFFERENT, WEAN_SURROGATE_SD], paths=12, lengths=(20, 60), seed=5)

    def test_what_was_written_is_read(self) -> None:
        rows = read_rows(self.export)
        self.assertEqual([row.name for row in rows], ["all-different", "wean-surrogate-sd"])
        self.assertEqual(rows[0].lengths, (20, 60))
        # By number, so path 10 comes after path 9.
        self.assertEqual([file.stem for file in rows[0].path_files], [str(path) for path in range(12)])
        file = rows[1].path_files[3]
        self.assertEqual(read_radii_mm(file, 20), read_radii_mm(file, 60)[:20])
        truth = read_truth(file, 20)
        self.assertEqual(len(truth.classes), 20)
        self.assertEqual(set(truth.classes), set(range(truth.class_count)))

    def test_a_path_that_is_too_short_is_refused(self) -> None:
        with self.assertRaises(ValueError):
            read_radii_mm(read_rows(self.export)[0].path_files[0], 61)

    def test_the_true_path_is_exact(self) -> None:
        for row in read_rows(self.export):
            for file in row.path_files:
                truth = read_truth(file, 60)
                found = score_map(map_of_path(truth.classes), truth.class_count, truth.edges, truth.classes)
                self.assertEqual(found, Score(True, True, 1.0, 1.0))

    def test_hints_and_true_places_do_not_change_what_a_peer_is_given(self) -> None:
        file = read_rows(self.export)[0].path_files[0]
        before = read_radii_mm(file, 60)
        head, *lines = file.read_text().splitlines()
        blinded = [f"0,{line.split(',')[1]},1,3" for line in lines]
        file.write_text("\n".join([head, *blinded]))
        self.assertEqual(read_radii_mm(file, 60), before)

    def test_look_alikes_that_no_walk_tells_apart_are_one_class(self) -> None:
        truth = smallest_equivalent(LOOK_ALIKE_NEIGHBOURS, [1, 0, 2, 0])
        self.assertEqual((truth["classes"], truth["vertices"], truth["edges"]), ([1, 0, 1, 0], 2, [[0, 1]]))
        self.assertEqual(smallest_equivalent(LOOK_ALIKE_NEIGHBOURS, [1, 0, 2, 4])["vertices"], 4)

    def test_the_first_version_of_our_report_is_read_too(self) -> None:
        entry = {"name": "a", "filter": "paper", "prior": "path", "length": 10, "paths": 1, "exact": 0.0}
        entry |= {"isomorphic": 0.0, "edge_f1": 0.5, "location_smoothed": 0.5, "seconds_per_place": 0.5}
        file = self.export / "ours.json"
        file.write_text(json.dumps({"environments": [entry]}))
        (result,) = read_ours(file)
        self.assertEqual((result.program, result.seconds_per_path), ("toposlam paper, prior path", 5.0))

    def test_the_table_has_every_peer_and_ours(self) -> None:
        ours = self.export / "ours.json"
        entry = {"name": "all-different", "filter": "paper", "length": 20, "paths": 12, "exact": 0.25}
        entry |= {"isomorphic": 0.5, "edge_f1": 0.75, "location_smoothed": 0.875, "seconds_per_place": 0.001}
        ours.write_text(json.dumps({"settings": {"prior": "none", "hints": "turn"}, "rows": [entry]}))
        results = self.export / "results.json"
        arguments = [str(self.export), "--paths", "1", "--lengths", "20", "--ours", str(ours), "--json", str(results)]
        with contextlib.redirect_stdout(io.StringIO()) as output, contextlib.redirect_stderr(io.StringIO()):
            self.assertEqual(peers.main(arguments), 0)
        lines = output.getvalue().splitlines()
        programs = [line.split(" | ")[2] for line in lines[2:]]
        self.assertEqual(programs, [*PEERS, "toposlam paper, hints turn", *PEERS])
        ours_line = "| all-different | 20 | toposlam paper, hints turn | 12 | 0.250 | 0.500 | 0.750 | 0.875 | 0.02 |"
        self.assertIn(f"{ours_line} - | - | - |", lines)
        ratios = [line.split(" | ")[9] for line in lines[2:]]
        self.assertTrue(all(float(ratio) > 0 for ratio in ratios[: len(PEERS)]), "the time of a peer over ours")
        self.assertEqual(set(ratios[len(PEERS) :]), {"-"})
        written = json.loads(results.read_text())["results"]
        self.assertEqual(len(written), 7)
        for result in written:
            if result["program"] in PEERS:
                self.assertGreater(result["seconds_per_path"], 0)
                self.assertGreater(result["peak_mebibytes"], result["working_mebibytes"])


class Peers(unittest.TestCase):
    def test_every_peer_maps_places_that_all_look_different(self) -> None:
        for peer in PEERS:
            with self.subTest(peer), tempfile.TemporaryDirectory() as folder:
                write_export(Path(folder) / "export", [ALL_DIFFERENT], paths=1, lengths=(100,), seed=2)
                result = peers.evaluate(peer, read_rows(Path(folder) / "export")[0], 100, None)
                self.assertEqual((result.exact, result.isomorphic, result.edge_f1), (1.0, 1.0, 1.0))

    def test_look_alikes_are_told_apart_by_what_is_around_them(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            write_export(Path(folder) / "export", [LOOK_ALIKES_IN_A_RING], paths=1, lengths=(200,), seed=3)
            row = read_rows(Path(folder) / "export")[0]
            truth = read_truth(row.path_files[0], 200)
            symbols = categorise(read_radii_mm(row.path_files[0], 200), 1)
            by_radius_alone = score_map(map_of_path(symbols), truth.class_count, truth.edges, truth.classes)
            self.assertLess(by_radius_alone.location_smoothed, 0.9)
            # A place may be held twice.
            for peer in PEERS:
                with self.subTest(peer):
                    result = peers.evaluate(peer, row, 200, None)
                    self.assertEqual((result.edge_f1, result.location_smoothed), (1.0, 1.0))

    def test_the_peer_with_actions_is_told_the_ways(self) -> None:
        # A corridor with a dead end at 900 mm, a junction and two rooms, one of which looks like the dead end.
        places = [(900.0, 0), (1500.0, 2), (900.0, 0), (1500.0, 2), (2000.0, 0), (1500.0, 2)] * 8
        exits = [None, 0.0, -1571.0, 0.0, 1571.0, 0.0]
        bearings = (-1571.0, 1571.0)
        ways = [Ways(bearings[:others], exits[step % 6]) for step, (_, others) in enumerate(places)]
        measured = measure("chmm-actions", [[radius_mm for radius_mm, _ in places]], [1], [ways])
        self.assertEqual(len(measured.paths[0]), len(places))
        # The robot turns back at every dead end, so every place of the junction is one.
        self.assertEqual(len(set(measured.paths[0][1::2])), 1)

    def test_a_seed_brings_the_same_path_and_a_short_one_is_no_failure(self) -> None:
        radii_mm = [900.0, 1502.0, 904.0, 2000.0, 1498.0, 900.0, 2006.0, 1500.0, 896.0, 1500.0]
        for peer in PEERS:
            with self.subTest(peer):
                first = measure(peer, [radii_mm, radii_mm[:1], radii_mm[:2]], [7, 7, 7])
                self.assertEqual([len(path) for path in first.paths], [10, 1, 2])
                self.assertEqual(first.paths[:1], measure(peer, [radii_mm], [7]).paths)

    def test_a_peer_that_fails_says_why(self) -> None:
        with self.assertRaisesRegex(RuntimeError, "ValueError"):
            measure("hmmlearn", [["not a number"] * 5], [1])


if __name__ == "__main__":
    unittest.main()
