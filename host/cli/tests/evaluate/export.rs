//! The files that `--export` writes.

use serde_json::{Value, json};
use std::{fs, path::Path};

use super::{FAMILY, MULTIGRAPH, TABLE_I, report};

fn json_file(file: &Path) -> Value {
    serde_json::from_slice(&fs::read(file).unwrap()).unwrap()
}

#[test]
fn exported_paths_contain_the_observations_and_the_ground_truth() {
    let directory = tempfile::tempdir().unwrap();
    let mut arguments = vec!["--environment", TABLE_I, "--family", FAMILY, "--family", FAMILY, "--paths", "4"];
    arguments.extend(["--lengths", "10,30", "--hints", "both,missing=0.3", "--seed", "9", "--fingerprint-bits", "8"]);
    report(&[arguments.as_slice(), &["--export", directory.path().to_str().unwrap()]].concat(), "2");

    let family = "family-1-3-8-10-2-3-4-0.03-right-resolving";
    let entry = |directory: &str, name: &str| json!({"directory": directory, "name": name, "paths": 4, "lengths": [10, 30], "seed": 9});
    let name = format!("family {FAMILY}");
    let again = format!("{family}-again");
    let manifest = json!([entry("table-i", "table-i"), entry(family, &name), entry(&again, &name)]);
    assert_eq!(json_file(&directory.path().join("manifest.json")), manifest);

    for (folder, path) in [("table-i", 0), (family, 0), (family, 3), (&again, 3)] {
        check_exported_path(&directory.path().join(folder), path);
    }
    let csv =
        |folder: &str, path| fs::read_to_string(directory.path().join(folder).join(format!("{path}.csv"))).unwrap();
    assert_eq!(csv(family, 2), csv(&again, 2));
    let environment =
        |path| json_file(&directory.path().join(family).join(format!("{path}.truth.json")))["labels"].clone();
    assert_eq!(environment(0), environment(3), "path 3 is again in the first of three environments");
    assert_ne!(environment(0), environment(1));
}

fn check_exported_path(folder: &Path, path: u64) {
    let csv = fs::read_to_string(folder.join(format!("{path}.csv"))).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("place,radius_mm,turn,degree"));
    let visits: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    let truth = json_file(&folder.join(format!("{path}.truth.json")));
    let numbers = |value: &Value| -> Vec<usize> {
        value.as_array().unwrap().iter().map(|number| number.as_u64().unwrap() as usize).collect()
    };
    let places = numbers(&truth["places"]);
    assert_eq!((visits.len(), places.len()), (30, 30));
    for (step, visit) in visits.iter().enumerate() {
        assert_eq!(visit[0], step.to_string());
        // Within five standard deviations, half a level of 32 mm, and the rounding.
        let label = &truth["labels"][places[step]];
        let (mean_mm, sd_mm) = (label[0].as_f64().unwrap(), label[1].as_f64().unwrap());
        assert!((visit[1].parse::<f64>().unwrap() - mean_mm).abs() <= 5.0 * sd_mm + 18.0);
        let turn = if step >= 2 && places[step] == places[step - 2] { "back" } else { "on" };
        assert!(visit[2].is_empty() || step >= 2 && visit[2] == turn);
        assert!(visit[3].is_empty() || (1..=7).contains(&visit[3].parse().unwrap()));
    }
    let edges = |value: &Value| value.as_array().unwrap().iter().map(numbers).collect::<Vec<_>>();
    let all = edges(&truth["edges"]);
    assert!(places.windows(2).all(|step| all.contains(&vec![step[0].min(step[1]), step[0].max(step[1])])));
    assert_eq!(truth["lengths"], json!([10, 30]));
    for length in [10, 30] {
        let judged = &truth["truth"][length.to_string()];
        let classes = numbers(&judged["classes"]);
        assert_eq!(classes.len(), length);
        assert_eq!(classes.iter().max().unwrap() + 1, judged["vertices"].as_u64().unwrap() as usize);
        let walked = |step: &[usize]| vec![step[0].min(step[1]), step[0].max(step[1])];
        let mut traversed: Vec<_> = classes.windows(2).map(walked).collect();
        traversed.sort();
        traversed.dedup();
        assert_eq!(edges(&judged["edges"]), traversed);
    }
    assert_eq!(truth["classes"], truth["truth"]["30"]["classes"]);
}

#[test]
fn exported_paths_contain_the_ways() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("multigraph.toml");
    fs::write(&file, MULTIGRAPH).unwrap();
    let export = directory.path().join("export");
    let course = ["--environment", file.to_str().unwrap(), "--paths", "1", "--lengths", "30", "--hints", "ways,travel"];
    report(&[&course[..], &["--export", export.to_str().unwrap()]].concat(), "2");
    let csv = fs::read_to_string(export.join("multigraph/0.csv")).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("place,radius_mm,turn,degree,ways_mrad,exit_mrad,travel_frames"));
    let truth = json_file(&export.join("multigraph/0.truth.json"));
    assert_eq!(truth["corridors"], json!([[0, 1], [0, 1], [1, 1], [1, 2]]));
    assert_eq!(truth["ways"], json!([[0, 1], [1, 0, 3, 2, 2], [3]]));
    for (step, line) in lines.enumerate() {
        let visit: Vec<&str> = line.split(',').collect();
        let place = truth["places"][step].as_u64().unwrap() as usize;
        assert_eq!(visit[3], ["2", "5", "1"][place]);
        let others: Vec<u32> = visit[4].split_whitespace().map(|bearing| bearing.parse().unwrap()).collect();
        assert_eq!(others.len(), [1, 4, 0][place]);
        assert!(others.is_sorted() && others.iter().all(|&bearing| (1..6283).contains(&bearing)));
        assert_eq!(visit[5].is_empty(), step == 0);
        assert_eq!(visit[2] == "back", visit[5] == "0");
        // 4, 9, 6 and 2 m at 0.3 m/s, ten frames a second.
        assert!(step == 0 || ["133", "300", "200", "67"].contains(&visit[6]), "{line}");
    }
}
