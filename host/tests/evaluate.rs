//! `toposlam evaluate` as a person or a script runs it.

use serde_json::{Value, json};
use std::{
    fs,
    process::{Command, Output},
};

fn evaluate(arguments: &[&str], threads: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_toposlam"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("RAYON_NUM_THREADS", threads)
        .env("RUST_BACKTRACE", "0")
        .arg("evaluate")
        .args(arguments)
        .output()
        .unwrap()
}

/// The one JSON object on the standard output, without the time, which differs from run to run.
fn report(arguments: &[&str], threads: &str) -> Value {
    let output = evaluate(arguments, threads);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    for environment in report["environments"].as_array_mut().unwrap() {
        let seconds = environment.as_object_mut().unwrap().remove("seconds_per_place").unwrap();
        assert!(seconds.as_f64().unwrap() > 0.0);
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

#[test]
fn the_report_has_the_documented_keys_and_shares_between_0_and_1() {
    let arguments = ["--environment", TABLE_I, SURROGATE, "--paths", "3", "--length", "20", "--particles", "4"];
    let report = report(&arguments, "2");
    assert_eq!(report.as_object().unwrap().keys().collect::<Vec<_>>(), ["environments"]);
    let environments = report["environments"].as_array().unwrap();
    assert_eq!(environments.len(), 2);
    for (environment, name) in environments.iter().zip(["table-i", "wean-surrogate-sd"]) {
        let mut keys: Vec<_> = environment.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        let expected = [
            "consistency_mm",
            "edge_f1",
            "exact",
            "filter",
            "isomorphic",
            "length",
            "location_online",
            "location_smoothed",
            "name",
            "particles",
            "paths",
            "prior",
            "seed",
            "vertices",
        ];
        assert_eq!(keys, expected);
        for (key, value) in [
            ("name", json!(name)),
            ("filter", json!("paper")),
            ("prior", json!("path")),
            ("paths", json!(3)),
            ("length", json!(20)),
            ("particles", json!(4)),
            ("seed", json!(1)),
        ] {
            assert_eq!(environment[key], value, "{key}");
        }
        for key in ["exact", "isomorphic", "edge_f1", "location_online", "location_smoothed"] {
            assert!((0.0..=1.0).contains(&environment[key].as_f64().unwrap()), "{key}");
        }
        let vertices = environment["vertices"].as_object().unwrap();
        assert_eq!(vertices.values().map(|maps| maps.as_u64().unwrap()).sum::<u64>(), 3);
        assert!(vertices.keys().all(|count| (1..=20).contains(&count.parse::<u32>().unwrap())));
        let consistency = &environment["consistency_mm"];
        assert!(consistency["median"].as_u64().unwrap() <= consistency["p90"].as_u64().unwrap());
    }
}

#[test]
fn the_same_seed_gives_the_same_report_on_any_number_of_threads() {
    for prior in ["path", "exploration", "none"] {
        let arguments =
            |seed| ["--environment", SURROGATE, "--paths", "4", "--length", "12", "--prior", prior, "--seed", seed];
        let first = report(&arguments("7"), "1");
        assert_eq!(first, report(&arguments("7"), "3"), "{prior}");
        let mut other = report(&arguments("8"), "1");
        other["environments"][0]["seed"] = json!(7);
        assert_ne!(first, other, "{prior}");
    }
}

#[test]
fn an_environment_gives_the_same_results_whatever_is_evaluated_beside_it() {
    let run = |environments: &[&str]| {
        report(&[&["--paths", "2", "--length", "12", "--environment"], environments].concat(), "2")
    };
    assert_eq!(run(&[TABLE_I, SURROGATE])["environments"][1], run(&[SURROGATE])["environments"][0]);
}

#[test]
fn a_building_of_distinct_places_is_mapped_exactly_when_vertices_are_dear() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("distinct.toml");
    let places = [(1, 700), (2, 1400), (3, 2100), (4, 2800)];
    let places = places.map(|(id, mean)| format!("[[place]]\nid = {id}\nmean_mm = {mean}\nsd_mm = 2.5\n")).concat();
    fs::write(&file, format!("name = \"distinct\"\nedges = [[1, 2], [2, 3], [3, 1], [3, 4]]\n{places}")).unwrap();
    let mut arguments = vec!["--environment", file.to_str().unwrap(), "--paths", "4", "--length", "40"];
    arguments.extend(["--prior", "exploration", "--consistency", "map-to-history", "--penalty", "0.5"]);
    let report = report(&arguments, "2");
    let environment = &report["environments"][0];
    assert_eq!(environment["vertices"], json!({ "4": 4 }));
    for key in ["exact", "isomorphic", "edge_f1", "location_online", "location_smoothed"] {
        assert_eq!(environment[key], json!(1.0), "{key}");
    }
    assert!(environment["consistency_mm"]["p90"].as_u64().unwrap() <= 20);
}

#[test]
fn the_table_names_the_environment() {
    let arguments = ["--environment", TABLE_I, "--paths", "1", "--length", "8", "--format", "table"];
    let output = evaluate(&arguments, "1");
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(table.lines().count(), 2);
    assert!(table.lines().nth(1).unwrap().starts_with("table-i "));
}

#[test]
fn what_cannot_be_evaluated_is_refused_with_its_reason() {
    let missing = refusal(&["--environment", "nowhere.toml"]);
    assert!(missing.contains("nowhere.toml") && missing.contains("cannot read the environment"));
    let table_i = |more: &[&str]| refusal(&[&["--environment", TABLE_I, "--paths", "1"], more].concat());
    assert!(table_i(&["--length", "5000"]).contains("the prior may need more than 8192 n-grams"));
    let too_long = "without a prior, a path may visit at most 2048 places";
    assert!(table_i(&["--length", "5000", "--prior", "none"]).contains(too_long));
    assert!(table_i(&["--particles", "200"]).contains("particles is out of its range"));
    assert!(table_i(&["--ngram-length", "8"]).contains("ngram_length is out of its range"));
    assert!(table_i(&["--penalty", "1"]).contains("--penalty: whole thousandths from 0 up to 0.999"));
    assert!(table_i(&["--length", "0"]).contains("--length"));
}
