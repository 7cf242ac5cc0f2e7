//! `toposlam evaluate` as run by a user or a script.

mod export;

use serde_json::{Value, json};
use std::{
    fs,
    process::{Command, Output},
};
use toposlam::RobustConfig;

fn evaluate(arguments: &[&str], threads: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_toposlam"))
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../eval"))
        .env("RUST_BACKTRACE", "0")
        .args(["evaluate", "--threads", threads])
        .args(arguments)
        .output()
        .unwrap()
}

/// The JSON object on the standard output, without the times, which differ from run to run.
fn report(arguments: &[&str], threads: &str) -> Value {
    let output = evaluate(arguments, threads);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    for row in report["rows"].as_array_mut().unwrap() {
        let row = row.as_object_mut().unwrap();
        assert!(row.remove("seconds_per_place").unwrap().as_f64().unwrap() >= 0.0);
        assert!(row.remove("prior_seconds").unwrap().as_f64().unwrap() >= 0.0);
    }
    report
}

fn refusal(arguments: &[&str]) -> String {
    let output = evaluate(arguments, "1");
    assert!(!output.status.success());
    assert!(output.stdout.is_empty());
    String::from_utf8(output.stderr).unwrap()
}

const SURROGATE: &str = "environments/wean-surrogate-sd.toml";
const TABLE_I: &str = "environments/table-i.toml";
const PLACEMENTS: &str = "1,2,environments/wean-surrogate-sd.toml";
const NOISY_WAYS: &str = "ways,travel=0.1,missing=0.05,wrong=0.04,missed=0.05,bearing_mrad=100";
const FAMILY: &str = "1,3,8,10,2-3,4,0.03,right-resolving";

#[test]
fn the_report_has_the_documented_keys_and_shares_between_0_and_1() {
    let cases = ["--environment", TABLE_I, SURROGATE, "--placements", PLACEMENTS, "--family", FAMILY];
    let robust = RobustConfig::DEFAULT;
    for (filter, parameters) in [
        (
            "robust",
            json!({
                "hypotheses": 4, "moves": robust.moves, "noise_mm": robust.noise_mm,
                "wrong_degree": f64::from(robust.wrong_degree_permille) / 1000.0,
                "wrong_turn": f64::from(robust.wrong_turn_permille) / 1000.0,
            }),
        ),
        (
            "paper",
            json!({
                "consistency": "two-sided", "hypotheses": 4, "penalty": 0.1, "sigma_consistency_mm": 30,
                "sigma_label_mm": 50,
            }),
        ),
    ] {
        let course = ["--paths", "4", "--lengths", "10,20", "--hypotheses", "4", "--filter", filter];
        let report = report(&[cases.as_slice(), &course].concat(), "2");
        let settings = json!({
            "seed": 1, "walk": "uniform", "prior": "none", "hints": "none", "bearings": "spread", "fingerprint_bits": 12, "ngram_length": 5,
            "refinement_steps": 10, "prior_refinement_steps": 10, "search_from_truth": 0,
            "filters": { filter: parameters },
        });
        assert_eq!(report["settings"], settings);
        let family = format!("family {FAMILY}");
        let cases = [
            ("table-i", 1, json!(null)),
            ("wean-surrogate-sd", 1, json!(null)),
            ("wean-surrogate-sd, 2 placements", 2, json!(1)),
            (&*family, 3, json!(1)),
        ];
        let expected = cases.iter().flat_map(|case| [(case, 10), (case, 20)]);
        let rows = report["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 8);
        for (row, ((name, environments, seed), length)) in rows.iter().zip(expected) {
            check_row(row, filter);
            for (key, value) in [
                ("name", json!(name)),
                ("environments", json!(environments)),
                ("environment_seed", seed.clone()),
                ("length", json!(length)),
            ] {
                assert_eq!(row[key], value, "{key}");
            }
        }
    }
}

fn check_row(row: &Value, filter: &str) {
    let mut keys: Vec<_> = row.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    let expected = [
        "consistency_bins",
        "consistency_mm",
        "edge_f1",
        "environment_seed",
        "environments",
        "exact",
        "exact_interval",
        "filter",
        "isomorphic",
        "length",
        "location_online",
        "location_smoothed",
        "name",
        "paths",
        "paths_not_exhaustive",
        "places_until_exact",
        "reliability",
        "vertices",
        "vertices_full",
    ];
    assert_eq!(keys, expected);
    assert_eq!((&row["filter"], &row["paths"]), (&json!(filter), &json!(4)));
    let number = |key: &str| row[key].as_f64().unwrap();
    for key in ["exact", "isomorphic", "edge_f1", "location_online", "location_smoothed"] {
        assert!((0.0..=1.0).contains(&number(key)), "{key}");
    }
    let interval = [0, 1].map(|end| row["exact_interval"][end].as_f64().unwrap());
    assert!(interval[0] <= number("exact") && number("exact") <= interval[1]);
    for key in ["vertices", "consistency_bins"] {
        let maps = row[key].as_object().unwrap().values().map(|maps| maps.as_u64().unwrap());
        assert_eq!(maps.sum::<u64>(), 4, "{key}");
    }
    let bins = row["reliability"]["bins"].as_array().unwrap();
    assert_eq!((bins.len(), bins.iter().map(|bin| bin["maps"].as_u64().unwrap()).sum::<u64>()), (10, 4));
    assert!(row["consistency_mm"]["median"].as_u64().unwrap() <= row["consistency_mm"]["p90"].as_u64().unwrap());
}

#[test]
fn the_same_seed_gives_the_same_report_on_any_number_of_threads() {
    let (both, all) = ("both,missing=0.2,wrong=0.1", &["path", "exploration", "none"][..]);
    for (filter, hints, priors) in [
        ("robust", both, all),
        ("paper", both, all),
        ("ordered", NOISY_WAYS, &["path", "none"]),
        ("robust", NOISY_WAYS, &["none"]),
    ] {
        for prior in priors {
            let course = [
                "--environment",
                SURROGATE,
                "--family",
                FAMILY,
                "--paths",
                "4",
                "--length",
                "12",
                "--refinement-steps",
                "1",
                "--prior-refinement-steps",
                "0",
            ];
            let more = ["--filter", filter, "--prior", prior, "--hints", hints];
            let run = |seed, threads| report(&[&course, more.as_slice(), &["--seed", seed]].concat(), threads);
            let first = run("7", "1");
            assert_eq!(first, run("7", "3"), "{filter} {prior}");
            assert_ne!(first["rows"], run("8", "1")["rows"], "{filter} {prior}");
        }
    }
}

#[test]
fn the_results_of_a_case_do_not_depend_on_other_cases() {
    let run = |cases: &[&str]| report(&[&["--filter", "paper", "--paths", "2", "--length", "12"], cases].concat(), "2");
    let alone = run(&["--environment", SURROGATE]);
    assert_eq!(run(&["--environment", TABLE_I, SURROGATE, "--family", FAMILY])["rows"][1], alone["rows"][0]);
}

#[test]
fn an_earlier_check_point_does_not_change_a_later_one() {
    let run =
        |lengths| report(&["--environment", SURROGATE, "--paths", "3", "--filter", "paper", "--lengths", lengths], "2");
    assert_eq!(run("20,60")["rows"][1], run("60")["rows"][0]);
}

#[test]
fn distinct_places_are_mapped_exactly_with_a_high_vertex_penalty() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("distinct.toml");
    let places = [(1, 700), (2, 1400), (3, 2100), (4, 2800)];
    let places = places.map(|(id, mean)| format!("[[place]]\nid = {id}\nmean_mm = {mean}\nsd_mm = 2.5\n")).concat();
    fs::write(&file, format!("name = \"distinct\"\nedges = [[1, 2], [2, 3], [3, 1], [3, 4]]\n{places}")).unwrap();
    let mut arguments = vec!["--environment", file.to_str().unwrap(), "--paths", "4", "--length", "40"];
    arguments.extend(["--filter", "paper", "--prior", "exploration", "--consistency", "map-to-history"]);
    arguments.extend(["--penalty", "0.5"]);
    let report = report(&arguments, "2");
    let row = &report["rows"][0];
    assert_eq!(row["vertices"], json!({ "4": 4 }));
    for key in ["exact", "isomorphic", "edge_f1", "location_online", "location_smoothed"] {
        assert_eq!(row[key], json!(1.0), "{key}");
    }
    assert!(row["consistency_mm"]["p90"].as_u64().unwrap() <= 20);
    let until_exact = row["places_until_exact"]["p90"].as_u64().unwrap();
    assert!((10..=40).contains(&until_exact) && until_exact.is_multiple_of(10));
}

#[test]
fn walks_that_never_turn_back_do_not_fold_a_building_onto_two_places() {
    let environments = ["--environment", "environments/office.toml", "environments/ring.toml"];
    let walks = ["--walk", "forward", "--paths", "8", "--lengths", "100"];
    let report = report(&[environments.as_slice(), &walks].concat(), "2");
    for (row, exact) in report["rows"].as_array().unwrap().iter().zip([0.9, 0.6]) {
        assert!(row["exact"].as_f64().unwrap() >= exact, "{row}");
        // No map of two vertices.
        assert!(row["vertices"].as_object().unwrap().keys().all(|vertices| vertices.parse::<u32>().unwrap() >= 8));
    }
}

#[test]
fn the_table_shows_the_seed_and_names_every_row() {
    let arguments = ["--environment", TABLE_I, "--family", FAMILY, "--paths", "1", "--lengths", "4,8", "--seed", "5"];
    let output = evaluate(&[arguments.as_slice(), &["--format", "table"]].concat(), "1");
    let table = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 7);
    assert!(lines[0].starts_with(
        "seed 5, walk uniform, prior none, hints none, 12 bits, n = 5, 10 refinement steps; robust: hypotheses 10"
    ));
    assert!(lines[1].starts_with("name "));
    assert!(lines[2].starts_with("table-i ") && lines[3].starts_with("table-i "));
    assert!(lines[5].starts_with(&format!("family {FAMILY} robust")));
    assert!(lines[6].starts_with("robust filter: stated probability of the map, share exact (maps): "));
}

/// A file with parallel edges, a loop and a dead end. Place 3 has the label of place 1.
const MULTIGRAPH: &str = "name = \"multigraph\"\nedges = [[1, 2], [1, 2], [2, 2], [2, 3]]\nlengths_m = [4, 9, 6, 2]\n\
    [[place]]\nid = 1\nmean_mm = 800\nsd_mm = 20\nways = [0, 1]\n\
    [[place]]\nid = 2\nmean_mm = 1500\nsd_mm = 20\nways = [1, 0, 3, 2, 2]\n\
    [[place]]\nid = 3\nmean_mm = 800\nsd_mm = 20\nways = [3]\n";

#[test]
fn maps_with_loops_and_parallel_edges_are_exact_by_their_ways() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("multigraph.toml");
    fs::write(&file, MULTIGRAPH).unwrap();
    let course = ["--environment", file.to_str().unwrap(), "--paths", "5", "--lengths", "20,100", "--from-truth", "20"];
    for walk in ["uniform", "forward", "explore"] {
        let report = report(&[&course[..], &["--hints", NOISY_WAYS, "--walk", walk]].concat(), "2");
        assert_eq!((&report["settings"]["walk"], &report["settings"]["hints"]), (&json!(walk), &json!(NOISY_WAYS)));
        assert_eq!(report["settings"]["filters"]["ordered"]["wrong_exit"], json!(0.04));
        let row = &report["rows"][1];
        assert_eq!((&row["filter"], &row["paths_not_exhaustive"]), (&json!("ordered"), &json!(0)), "{walk}");
        for key in ["exact", "exact_edges", "isomorphic", "edge_f1"] {
            assert_eq!(row[key], json!(1.0), "{walk}: {key}");
        }
        assert_eq!((&row["vertices"], &row["limit"]), (&json!({ "3": 5 }), &json!(0.0)), "{walk}");
        assert!(row["location_smoothed"].as_f64().unwrap() > 0.95, "{walk}");
    }
}

#[test]
fn the_ordered_filter_maps_fingerprints_alone_and_a_multigraph_family() {
    let arguments = ["--environment", TABLE_I, "--paths", "2", "--lengths", "60", "--filter", "ordered"];
    let row = &report(&arguments, "2")["rows"][0];
    assert_eq!((&row["filter"], &row["vertices_full"]), (&json!("ordered"), &json!(0)));
    let family = ["--family", "1,3,8,12,2-3,4,0.03,multigraph", "--paths", "6", "--lengths", "150", "--hints", "ways"];
    let report = report(&[&family[..], &["--bearings", "right-angles"]].concat(), "2");
    assert_eq!(report["settings"]["bearings"], json!("right-angles"));
    assert!(report["rows"][0]["exact"].as_f64().unwrap() > 0.8);
}

#[test]
fn plots_show_both_filters_on_the_same_paths() {
    let directory = tempfile::tempdir().unwrap();
    let plots = directory.path().join("plots");
    let arguments = ["--environment", TABLE_I, "--paths", "2", "--lengths", "6,12", "--penalty", "0.2", "--moves", "3"];
    let report = report(&[arguments.as_slice(), &["--plot", plots.to_str().unwrap()]].concat(), "2");
    let rows: Vec<_> = report["rows"].as_array().unwrap().iter().map(|row| (&row["filter"], &row["length"])).collect();
    let [robust, paper] = ["robust", "paper"].map(Value::from);
    assert_eq!(rows, [(&robust, &json!(6)), (&robust, &json!(12)), (&paper, &json!(6)), (&paper, &json!(12))]);
    for name in ["fig4.svg", "fig5.svg"] {
        let picture = fs::read_to_string(plots.join(name)).unwrap();
        assert!(picture.contains("table-i, 2 paths of 12 places"));
        assert!(picture.contains("robust filter: ") && picture.contains("paper's filter: "));
    }
    let reliability = fs::read_to_string(plots.join("reliability.svg")).unwrap();
    assert!(reliability.contains("robust filter") && reliability.contains("paper filter"));
}

#[test]
fn invalid_arguments_are_refused_with_a_reason() {
    let missing = refusal(&["--environment", "nowhere.toml"]);
    assert!(missing.contains("--environment nowhere.toml") && missing.contains("cannot read the environment"));
    assert!(refusal(&["--placements", "1,2,nowhere.toml"]).contains("--placements nowhere.toml"));
    assert!(refusal(&["--placements", "1,0,nowhere.toml"]).contains("--placements"));
    let family = refusal(&["--family", "1,1,8,7,2,3,0.03"]);
    assert!(family.contains("--family") && family.contains("V_MAX = 7: must be V_MIN or more"));
    assert!(refusal(&["--family", "1,1,3,3,2,1,0.03"]).contains("no such environment"));
    let directory = tempfile::tempdir().unwrap();
    let complete = directory.path().join("complete.toml");
    let places = (1..=5).map(|id| format!("[[place]]\nid = {id}\nmean_mm = 900\nsd_mm = 9\n")).collect::<String>();
    let edges = "[[1, 2], [1, 3], [1, 4], [1, 5], [2, 3], [2, 4], [2, 5], [3, 4], [3, 5], [4, 5]]";
    fs::write(&complete, format!("name = \"complete\"\nedges = {edges}\n{places}")).unwrap();
    let complete = ["--environment", complete.to_str().unwrap(), "--paths", "1", "--hints"];
    let not_planar = refusal(&[&complete[..], &["ways"]].concat());
    assert!(not_planar.contains("complete, ordered filter") && not_planar.contains("cannot be drawn in the plane"));
    report(&[&complete[..], &["turn"]].concat(), "1");
    assert!(refusal(&[]).contains("--environment"));
    for (arguments, reason) in [
        (
            &["--filter", "paper", "--prior", "path", "--length", "5000"][..],
            "the prior may need more than 8192 n-grams",
        ),
        (&["--filter", "paper", "--length", "5000"], "may visit at most 2048 places"),
        (&["--length", "20000"], "may visit at most 16384 places"),
        (&["--filter", "paper", "--particles", "200"], "particles is 200, but must be from 1 to 100"),
        (&["--hypotheses", "200"], "hypotheses is 200, but must be"),
        (&["--noise-mm", "0"], "noise_mm is 0, but must be"),
        (&["--wrong-turn", "0.9"], "wrong_turn_permille is 900, but must be"),
        (&["--wrong-degree", "0.0005"], "--wrong-degree"),
        (&["--ngram-length", "8"], "--ngram-length"),
        (&["--filter", "paper", "--penalty", "1"], "--penalty"),
        (&["--penalty", "0.1"], "--penalty needs --filter paper"),
        (&["--filter", "paper", "--moves", "1"], "--moves needs --filter robust"),
        (&["--hints", "ways", "--moves", "1"], "--moves needs --filter robust"),
        (&["--filter", "ordered", "--hypotheses", "20"], "--hypotheses needs --filter robust"),
        (&["--missed-way", "0.1"], "--missed-way needs --filter ordered"),
        (&["--hints", "ways", "--wrong-exit", "0.9"], "wrong_exit_permille is 900, but must be"),
        (&["--hints", "turn,travel"], "travel is a setting of the hints ways"),
        (&["--walk", "back"], "a walk is uniform, forward or explore, not back"),
        (&["--filter", "paper", "--plot", "nowhere"], "--plot"),
        (&["--length", "0"], "--lengths"),
        (&["--lengths", "50,20"], "--lengths: must be in ascending order"),
        (&["--fingerprint-bits", "13"], "--fingerprint-bits"),
        (&["--hints", "left"], "--hints"),
        (&["--hints", "turn,wrong=2"], "wrong=2: a probability is a number from 0 to 1"),
    ] {
        let refusal = refusal(&[&["--environment", TABLE_I, "--paths", "1"], arguments].concat());
        assert!(refusal.contains(reason), "{arguments:?}: {refusal}");
    }
}
